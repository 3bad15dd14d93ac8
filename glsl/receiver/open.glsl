// Slot <shadow> for a light that casts nothing.
float light_visibility(vec3 position_lv, vec3 normal_lv, float cosine) {
    return 1.0;
}
