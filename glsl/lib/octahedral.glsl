// Unit vector <-> two numbers in -1..1, and those as 2 x 16 bits.
// Meyer et al. 2010, "On Floating-Point Normal Vectors"; error below 4e-5 radians at 16 bits. Needs core330.

uint pack_direction(vec3 n) {
    n /= abs(n.x) + abs(n.y) + abs(n.z);
    vec2 folded = (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    vec2 octahedral = n.z >= 0.0 ? n.xy : folded;
    uvec2 bits = uvec2(clamp(octahedral * 0.5 + 0.5, 0.0, 1.0) * 65535.0 + 0.5);
    return bits.x | (bits.y << 16u);
}

vec3 unpack_direction(uint bits) {
    vec2 octahedral = vec2(float(bits & 65535u), float(bits >> 16u)) * (2.0 / 65535.0) - 1.0;
    vec3 n = vec3(octahedral, 1.0 - abs(octahedral.x) - abs(octahedral.y));
    float fold = max(-n.z, 0.0);
    n.x += n.x >= 0.0 ? -fold : fold;
    n.y += n.y >= 0.0 ? -fold : fold;
    return normalize(n);
}
