// A surface's plane as two floats, for a pass that compares neighbouring pixels: its distance from the origin and its unit normal, an
// octahedral map with 12 bits on each axis, a whole number that float32 represents exactly.
float pack_plane_normal(vec3 n) {
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    vec2 folded = (1.0 - abs(p.yx)) * vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
    p = n.z < 0.0 ? folded : p;
    vec2 whole = floor((0.5 * p + 0.5) * 4095.0 + 0.5);
    return whole.x + 4096.0 * whole.y;
}

vec3 unpack_plane_normal(float bits) {
    float high = floor(bits / 4096.0);
    vec2 p = vec2(bits - 4096.0 * high, high) * (2.0 / 4095.0) - 1.0;
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    vec2 folded = (1.0 - abs(p.yx)) * vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
    n.xy = n.z < 0.0 ? folded : n.xy;
    return normalize(n);
}
