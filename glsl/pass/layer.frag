// Composites a shaded layer of blended surfaces behind the layers before it: adds its light, as far as it is seen, to their sum; or, with
// GLS_PRODUCT, multiplies what they let through by what it lets through. Premultiplied, linear; see lib/peel.glsl.
#ifndef GLS_PRODUCT
#define GLS_PRODUCT 0
#endif
uniform sampler2D u_kept; // of the layer: what it lets through, its own share
#if !GLS_PRODUCT
uniform sampler2D u_through; // product of the layers before
uniform sampler2D u_light; // linear light of the layer
#endif
layout(location = 0) out vec4 o_blended;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 kept = texelFetch(u_kept, pixel, 0);
#if GLS_PRODUCT
    o_blended = vec4(kept.rgb, 1.0);
#else
    o_blended = vec4(texelFetch(u_through, pixel, 0).rgb * texelFetch(u_light, pixel, 0).rgb * kept.a, 0.0);
#endif
}
