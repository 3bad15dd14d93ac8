// What the surface buffer's fourth channel says of a material, 8 bits each: alpha (bits 0 to 7), roughness (255: matte), metallic,
// occlusion; all from 0 to 1, the roughness of what is matte more. Needs core330.
const vec4 MATERIAL_STEPS = vec4(255.0, 254.0, 255.0, 255.0);

uint pack_material(vec4 material) { // alpha, roughness, metallic, occlusion
    uvec4 bits = uvec4(clamp(max(material, 0.0) * MATERIAL_STEPS + 0.5, 0.0, 255.0));
    return bits.x | (bits.y << 8u) | (bits.z << 16u) | (bits.w << 24u);
}

vec4 unpack_material(uint bits) {
    return vec4(float(bits & 255u), float((bits >> 8u) & 255u), float((bits >> 16u) & 255u), float(bits >> 24u)) / MATERIAL_STEPS;
}
