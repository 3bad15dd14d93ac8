// Depth peeling: which fragments of blended surfaces make the next layer, and how much passes through them. Behind the layer before means
// greater depth, or the same depth and a greater triangle ID, so that every one of several coincident surfaces gets a layer. Draw triangles
// in the order of their IDs. Needs lib/surface_number.glsl. Everitt 2001, "Interactive Order-Independent Transparency".
#ifndef GLS_REVERSED
#define GLS_REVERSED 1 // 1: depth is 1 at the near plane
#endif
#ifndef GLS_TRANSMISSION_MAP
#define GLS_TRANSMISSION_MAP 0
#endif
uniform usampler2D u_peeled; // the layer before; 0 before the first
uniform sampler2D u_peeled_depth; // window depth; the near plane's before the first
uniform sampler2D u_opaque_depth; // of the nearest opaque surface
uniform float u_least_alpha; // 0: alpha blends; 1: it does not
uniform float u_transmission;
#if GLS_TRANSMISSION_MAP
uniform sampler2D u_transmission_map; // linear, red
#endif
layout(location = 1) out vec4 o_kept;

bool nearer(float a, float b) {
    return GLS_REVERSED == 1 ? a > b : a < b;
}

// Whether an opaque surface hides a depth. One that lies on an opaque surface is before it: within 1/64 pixel along its slope, since GL
// snaps vertices to 1/256, and within roundings of float32, which reach 1e-5 of a distance where a vertex is far beside the camera. `slope` is
// fwidth(depth).
bool is_hidden(float opaque, float depth, float slope) {
    float near = 0.015625 * slope + (GLS_REVERSED == 1 ? 1e-5 * depth : 2.4e-7);
    return nearer(opaque, GLS_REVERSED == 1 ? depth + near : depth - near);
}

bool is_next(uint surface, float slope) {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float before = texelFetch(u_peeled_depth, pixel, 0).r;
    bool behind = nearer(before, gl_FragCoord.z)
        || before == gl_FragCoord.z && triangle_of(surface) > triangle_of(texelFetch(u_peeled, pixel, 0).r);
    return behind && !is_hidden(texelFetch(u_opaque_depth, pixel, 0).r, gl_FragCoord.z, slope);
}

vec4 kept_of(vec4 color, float transmission) { // rgb: share of the light from behind that is seen; a: weight of the surface's own light
    float alpha = clamp(max(color.a, u_least_alpha), 0.0, 1.0);
    return vec4(vec3(1.0 - alpha) + alpha * transmission * clamp(color.rgb, 0.0, 1.0), alpha);
}
