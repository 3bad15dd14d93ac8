// Transmittance of a translucent caster, seen from the light, and its depth: the nearest is drawn first, then the colours by multiplication.
// With GLS_BEHIND only what is behind the layer before.
#ifndef GLS_TEXTURED
#define GLS_TEXTURED 0
#endif
#ifndef GLS_COLORED
#define GLS_COLORED 0
#endif
#ifndef GLS_ALPHA
#define GLS_ALPHA 0 // 1: cut out by its alpha
#endif
#ifndef GLS_BEHIND
#define GLS_BEHIND 0
#endif
#ifndef GLS_TRANSMISSION_MAP
#define GLS_TRANSMISSION_MAP 0 // needs GLS_TEXTURED
#endif
uniform vec4 u_color; // linear factor, alpha straight
uniform float u_least_alpha; // 0: alpha blends; 1: it does not
uniform float u_transmission;
#if GLS_ALPHA
uniform float u_cutoff;
#endif
#if GLS_BEHIND
uniform sampler2D u_before; // the layer before
#endif
#if GLS_TEXTURED
in vec2 v_uv;
uniform sampler2D u_texture; // sRGB format: decoded before it is filtered
#endif
#if GLS_TRANSMISSION_MAP
uniform sampler2D u_transmission_map; // linear, red
#endif
#if GLS_COLORED
in vec4 v_color;
#endif
layout(location = 0) out vec4 o_through;

void main() {
    vec4 color = u_color;
#if GLS_COLORED
    color *= v_color;
#endif
#if GLS_TEXTURED
    color *= texture(u_texture, v_uv);
#endif
    bool exists = true;
#if GLS_ALPHA
    exists = color.a >= u_cutoff;
#endif
#if GLS_BEHIND
    exists = exists && gl_FragCoord.z > texelFetch(u_before, ivec2(gl_FragCoord.xy), 0).a;
#endif
    float transmission = u_transmission;
#if GLS_TRANSMISSION_MAP
    transmission *= texture(u_transmission_map, v_uv).r;
#endif
    if (!exists) discard;
    // none at alpha 1, all at alpha 0; between them the more coloured, the higher the alpha; and what the material transmits
    float alpha = clamp(max(color.a, u_least_alpha), 0.0, 1.0);
    vec3 base = clamp(color.rgb, 0.0, 1.0);
    o_through = vec4((1.0 - alpha) * mix(vec3(1.0), base, alpha) + alpha * transmission * base, gl_FragCoord.z);
}
