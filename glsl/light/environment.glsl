// Slot <light>: light from an image of the surroundings; its zenith is +z of its view. GLS_WIDE: a surface's irradiance does not come from a
// single direction. GLS_PER_CHANNEL: nor is it the same in each channel. Irradiance by normal is a table: Ramamoorthi, Hanrahan 2001. Twin:
// glshadow.lights.environment_map. Needs lib/finish.glsl
#define GLS_WIDE 1
#define GLS_PER_CHANNEL 1
uniform sampler2D u_irradiance; // rows from the zenith to the nadir, their centres included; columns from +z over +x, around
uniform mat3 u_map_from_lv;

vec4 light_arriving(vec3 position_lv) {
    return vec4(0.0, 0.0, 1.0, 1.0);
}

bool light_shines_on(vec3 position_lv) {
    return true;
}

vec3 light_irradiance(vec3 position_lv, vec3 normal) { // of each channel, relative to a uniform image of radiance 1
    vec3 n = u_map_from_lv * normal;
    float across = abs(n.x) + abs(n.z);
    float angle = across > 0.0 ? atan(n.x, -n.z) : 0.0;
    vec2 place = vec2(angle / 6.283185307 + 0.5, atan(length(n.xz), n.y) / 3.141592654);
    return GLS_TEXTURE_2D(u_irradiance, vec2(place.x + 0.5 / 256.0, (128.0 * place.y + 0.5) / 129.0)).rgb;
}

vec2 light_received(vec3 position_lv, vec3 normal) { // its luminance; all of it counts as above the horizon
    return vec2(dot(light_irradiance(position_lv, normal), LUMINANCE), 1.0);
}
