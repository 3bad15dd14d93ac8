// Four texels compared one by one, for drivers without gather. Needs `compare_one`.
vec4 compare_four(vec2 corner, float reference) {
    return vec4(compare_one(corner + vec2(-0.5, 0.5), reference), compare_one(corner + vec2(0.5, 0.5), reference),
                compare_one(corner + vec2(0.5, -0.5), reference), compare_one(corner + vec2(-0.5, -0.5), reference));
}
