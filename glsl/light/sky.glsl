// Slot <light>: a uniform dome over the horizon; its zenith is +z of its view. GLS_WIDE: a surface's irradiance does not come from a single
// direction. The isotropic sky of Liu and Jordan 1963. Twin: glshadow.lights.sky
#define GLS_WIDE 1

vec4 light_arriving(vec3 position_lv) {
    return vec4(0.0, 0.0, 1.0, 1.0);
}

bool light_shines_on(vec3 position_lv) {
    return true;
}

vec2 light_received(vec3 position_lv, vec3 normal) { // irradiance relative to a full sky; all of it counts as above the horizon
    return vec2(0.5 + 0.5 * normal.z, 1.0);
}
