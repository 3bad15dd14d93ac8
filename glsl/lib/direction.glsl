// A vector of length at most 1 as 11 + 11 + 10 bits, never 0, and back, 1024 times as long: a direction within 0.001 radians.
// GLS_OCTAHEDRAL: a direction as 16 + 16 bits, never 0, within 6.5e-5 radians, for highlights; needs lib/octahedral.glsl.
// Needs core330.
#ifndef GLS_OCTAHEDRAL
#define GLS_OCTAHEDRAL 0
#endif
#if GLS_OCTAHEDRAL

uint pack_direction(vec3 direction) { // twin: glshadow.geometry.smooth.pack_octahedral
    vec3 v = direction / max(dot(abs(direction), vec3(1.0)), 1e-30);
    vec2 folded = (1.0 - abs(v.yx)) * vec2(v.x < 0.0 ? -1.0 : 1.0, v.y < 0.0 ? -1.0 : 1.0);
    uvec2 bits = uvec2(round((v.z < 0.0 ? folded : v.xy) * 32767.0) + 32768.0);
    return bits.x | (bits.y << 16u);
}

vec3 unpack_direction(uint bits) {
    return unpack_octahedral(bits);
}
#else

uint pack_direction(vec3 direction) {
    uvec3 bits = uvec3(direction * vec3(1023.0, 1023.0, 511.0) + vec3(1024.5, 1024.5, 512.5)); // 1..2047, 1..2047, 1..1023
    return bits.x | (bits.y << 11u) | (bits.z << 22u);
}

vec3 unpack_direction(uint bits) {
    return vec3(float(bits & 2047u), float((bits >> 11u) & 2047u), 2.0 * float(bits >> 22u)) - 1024.0;
}
#endif
