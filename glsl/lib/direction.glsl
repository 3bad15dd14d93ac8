// A vector of length at most 1 as 11 + 11 + 10 bits, never 0, and back, 1024 times as long: a direction within 0.001 radians.
// Needs core330.

uint pack_direction(vec3 direction) {
    uvec3 bits = uvec3(direction * vec3(1023.0, 1023.0, 511.0) + vec3(1024.5, 1024.5, 512.5)); // 1..2047, 1..2047, 1..1023
    return bits.x | (bits.y << 11u) | (bits.z << 22u);
}

vec3 unpack_direction(uint bits) {
    return vec3(float(bits & 2047u), float((bits >> 11u) & 2047u), 2.0 * float(bits >> 22u)) - 1024.0;
}
