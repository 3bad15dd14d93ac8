// What the surface buffer's fourth channel says of a material, 8 bits each: alpha (bits 0 to 7), roughness, metallic, occlusion; all from 0
// to 1. Needs core330.

uint pack_material(vec4 material) { // alpha, roughness, metallic, occlusion
    uvec4 bits = uvec4(clamp(material, 0.0, 1.0) * 255.0 + 0.5);
    return bits.x | (bits.y << 8u) | (bits.z << 16u) | (bits.w << 24u);
}

vec4 unpack_material(uint bits) {
    return vec4(float(bits & 255u), float((bits >> 8u) & 255u), float((bits >> 16u) & 255u), float(bits >> 24u)) / 255.0;
}
