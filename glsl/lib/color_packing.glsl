// Linear colour in 0..1 as 11 + 11 + 10 bits of its square root, which keeps precision in dark tones. Needs core330.

uint pack_color(vec3 linear) {
    uvec3 bits = uvec3(sqrt(clamp(linear, 0.0, 1.0)) * vec3(2047.0, 2047.0, 1023.0) + 0.5);
    return bits.r | (bits.g << 11u) | (bits.b << 22u);
}

vec3 unpack_color(uint bits) {
    vec3 root = vec3(float(bits & 2047u), float((bits >> 11u) & 2047u), float(bits >> 22u)) / vec3(2047.0, 2047.0, 1023.0);
    return root * root;
}
