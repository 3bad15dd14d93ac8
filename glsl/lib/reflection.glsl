// Reflection of light from one direction by glTF's metallic-roughness material: Lambert's law and GGX. Sources, equations and twin:
// glshadow.lights.reflection. Needs core330.
#ifndef GLS_GLOSSY
#define GLS_GLOSSY 0
#endif
const float LEAST_ROUGHNESS = 0.045, DIELECTRIC = 0.04;

// The same of what is not metallic and of roughness 1, where GGX is a constant: shares of the base colour and of white, which are multiplied
// by the light's cosine. The lost share of light is a straight line through the table.
vec2 reflected_roughly(vec3 normal, vec3 to_eye, vec3 to_light) {
    float cos_light = max(dot(normal, to_light), 0.0), cos_eye = max(dot(normal, to_eye), 0.0);
    float away = 1.0 - sqrt(max(0.5 + 0.5 * dot(to_eye, to_light), 0.0)), grazing = away * away;
    grazing *= grazing * away;
    float mirrored = DIELECTRIC + (1.0 - DIELECTRIC) * grazing;
    float specular = mirrored * (1.0 + DIELECTRIC * (0.2 + 2.1 * cos_eye)) * 0.5 / max(cos_light + cos_eye, 1e-6);
    return vec2(1.0 - mirrored, specular);
}

#if GLS_GLOSSY
uniform sampler2D u_albedo; // by roughness and cosine to the eye: what one bounce at perfectly reflecting microfacets returns

// unit vectors in any axes; relative to the light of a white matte surface that faces the light
vec3 reflected(vec3 color, float metallic, float roughness, vec3 normal, vec3 to_eye, vec3 to_light) {
    float rough = max(roughness, LEAST_ROUGHNESS), square = rough * rough * rough * rough;
    float cos_light = max(dot(normal, to_light), 0.0), cos_eye = max(dot(normal, to_eye), 0.0);
    vec3 half_ = to_eye + to_light;
    half_ *= inversesqrt(max(dot(half_, half_), 1e-30));
    vec3 across = cross(normal, half_); // one minus the squared cosine would cancel
    float cos_half = dot(normal, half_), spread = dot(across, across) + square * cos_half * cos_half;
    float lobe = square / (spread * spread); // pi times the distribution
    float eye = cos_light * sqrt(square + (1.0 - square) * cos_eye * cos_eye);
    float light = cos_eye * sqrt(square + (1.0 - square) * cos_light * cos_light);
    lobe *= 0.5 / max(eye + light, 1e-6);
    float away = 1.0 - clamp(dot(to_eye, half_), 0.0, 1.0), grazing = away * away * away * away * away;
    vec3 base = mix(vec3(DIELECTRIC), color, metallic);
    float last = float(textureSize(u_albedo, 0).x - 1);
    float lost = 1.0 / textureLod(u_albedo, (vec2(cos_eye, rough) * last + 0.5) / (last + 1.0), 0.0).r - 1.0;
    vec3 specular = (base + (1.0 - base) * grazing) * (1.0 + base * lost) * lobe;
    vec3 diffuse = color * ((1.0 - metallic) * (1.0 - DIELECTRIC - (1.0 - DIELECTRIC) * grazing));
    return (diffuse + specular) * cos_light;
}
#endif
