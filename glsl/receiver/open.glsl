// Slot <shadow> for a light without shadows: always lit.
float light_visibility(vec3 position_lv, vec3 normal_lv, float cosine) {
    return 1.0;
}
