// Emitted light in 32 bits: an exponent of 2 for all three channels, and 9 bits of the square root of each channel below it, which keeps
// precision in dark tones: within 0.2 % of the brightest channel. From 2^-15 to 65408. Needs core330.

uint pack_emission(vec3 light) {
    float top = clamp(max(light.r, max(light.g, light.b)), 0.0, 65408.0);
    if (top < exp2(-15.0)) return 0u;
    uint bits = floatBitsToUint(top);
    int exponent = int(bits >> 23u) - 127 + ((bits & 0x7fffffu) != 0u ? 1 : 0); // of the least power of two that is not less
    uvec3 root = uvec3(sqrt(clamp(light * exp2(-float(exponent)), 0.0, 1.0)) * 511.0 + 0.5);
    return root.r | (root.g << 9u) | (root.b << 18u) | (uint(exponent + 15) << 27u);
}

vec3 unpack_emission(uint bits) {
    vec3 root = vec3(float(bits & 511u), float((bits >> 9u) & 511u), float((bits >> 18u) & 511u)) / 511.0;
    return root * root * exp2(float(bits >> 27u) - 15.0);
}
