// The unmoved receiver: for the receiver-plane bias, for biases applied to the caster, and without a bias.
vec3 biased_position(vec3 position_lv, vec3 normal_lv, float cosine) {
    return position_lv;
}
