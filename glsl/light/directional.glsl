// Slot <light>: parallel light, along -z of its view. Twin: glshadow.lights.directional
vec4 light_arriving(vec3 position_lv) {
    return vec4(0.0, 0.0, 1.0, 1.0);
}

bool light_shines_on(vec3 position_lv) {
    return true;
}
