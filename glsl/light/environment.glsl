// Slot <light>: light from an image of the surroundings; its zenith is +z of its view. GLS_WIDE: a surface's irradiance does not come from a
// single direction. GLS_PER_CHANNEL: nor is it the same in each channel. Irradiance by normal is a table: Ramamoorthi, Hanrahan 2001. Twin:
// glshadow.lights.environment_map. Needs lib/finish.glsl
#define GLS_WIDE 1
#define GLS_PER_CHANNEL 1
#ifndef GLS_GLOSSY
#define GLS_GLOSSY 0
#endif
#ifndef GLS_ROUGH
#define GLS_ROUGH 0
#endif
uniform sampler2D u_irradiance; // rows from the zenith to the nadir, their centres included; columns from +z over +x, around
uniform mat3 u_map_from_lv;

vec4 light_arriving(vec3 position_lv) {
    return vec4(0.0, 0.0, 1.0, 1.0);
}

bool light_shines_on(vec3 position_lv) {
    return true;
}

vec2 light_place(vec3 direction) { // in a table, from 0 to 1 around and down
    vec3 n = u_map_from_lv * direction;
    float across = abs(n.x) + abs(n.z);
    float angle = across > 0.0 ? atan(n.x, -n.z) : 0.0;
    return vec2(angle / 6.283185307 + 0.5, atan(length(n.xz), n.y) / 3.141592654);
}

vec3 light_irradiance(vec3 position_lv, vec3 normal) { // of each channel, relative to a uniform image of radiance 1
    vec2 place = light_place(normal);
    return GLS_TEXTURE_2D(u_irradiance, vec2(place.x + 0.5 / 256.0, (128.0 * place.y + 0.5) / 129.0)).rgb;
}

vec2 light_received(vec3 position_lv, vec3 normal) { // its luminance; all of it counts as above the horizon
    return vec2(dot(light_irradiance(position_lv, normal), LUMINANCE), 1.0);
}

#if GLS_GLOSSY || GLS_ROUGH
uniform sampler2D u_reflection; // eight such tables, one above the other: by roughness
uniform sampler2D u_split; // by roughness and cosine to the eye: factor of the reflectance at normal incidence, and what is added to it

vec3 light_reflection(vec3 direction, float roughness) { // what a perfect reflector of this roughness shows
    vec2 place = light_place(direction);
    place = vec2(place.x + 0.5 / 256.0, 128.0 * place.y + 0.5);
    float along = clamp(roughness, 0.0, 1.0) * 7.0, level = min(floor(along), 6.0);
    vec3 lower = GLS_TEXTURE_2D(u_reflection, vec2(place.x, (place.y + 129.0 * level) / 1032.0)).rgb;
    vec3 upper = GLS_TEXTURE_2D(u_reflection, vec2(place.x, (place.y + 129.0 * (level + 1.0)) / 1032.0)).rgb;
    return mix(lower, upper, along - level);
}

vec3 light_reflectance(vec3 base, float roughness, float cos_eye) { // with what bounces between microfacets, see lib/reflection.glsl
    float last = float(textureSize(u_split, 0).x - 1);
    vec2 split = GLS_TEXTURE_2D(u_split, (vec2(cos_eye, roughness) * last + 0.5) / (last + 1.0)).rg;
    return (base * split.x + split.y) * (1.0 + base * (1.0 / (split.x + split.y) - 1.0));
}
#endif
