// A unit vector from 16 + 16 bits. Twin: glshadow.geometry.smooth.pack_octahedral
vec3 unpack_octahedral(uint bits) {
    vec2 p = (vec2(float(bits & 0xffffu), float(bits >> 16u)) - 32768.0) / 32767.0;
    vec3 v = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    float fold = max(-v.z, 0.0);
    v.xy -= vec2(p.x < 0.0 ? -fold : fold, p.y < 0.0 ? -fold : fold);
    return normalize(v);
}
