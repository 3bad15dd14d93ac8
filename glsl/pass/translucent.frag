// Transmittance of a translucent caster, seen from the light; blended by multiplication.
#ifndef GLS_TEXTURED
#define GLS_TEXTURED 0
#endif
#ifndef GLS_COLORED
#define GLS_COLORED 0
#endif
uniform vec4 u_color; // linear factor, alpha straight
#if GLS_TEXTURED
in vec2 v_uv;
uniform sampler2D u_texture; // sRGB format: decoded before it is filtered
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
    // none at alpha 1, all at alpha 0; between them the more coloured, the higher the alpha
    float alpha = clamp(color.a, 0.0, 1.0);
    o_through = vec4((1.0 - alpha) * mix(vec3(1.0), clamp(color.rgb, 0.0, 1.0), alpha), 1.0);
}
