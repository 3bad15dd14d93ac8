// Parallel light: it comes along +z of its view.
vec4 light_arriving(vec3 position_lv) {
    return vec4(0.0, 0.0, 1.0, 1.0);
}
