// Alpha-tested materials of exact filters: whether a masked triangle is opaque where a ray hits it. Alpha is that of the finest level,
// wrapped and magnified as its sampler says, as GL samples it. Twins: glshadow.reference.masks, glshadow.scene.texture
uniform usamplerBuffer u_masks; // three texels per triangle: corners' texture coordinates and alpha, cutoff, image: start | sampling << 27,
// width | height << 16
uniform samplerBuffer u_alphas; // alpha of all images, row 0 at v = 0

int wrapped(int texel, int size, uint wrap) { // 0: repeated, 1: clamped to the border, 2: mirrored
    int period = wrap == 2u ? 2 * size : size;
    int turned = texel - period * int(floor(float(texel) / float(period)));
    return wrap == 1u ? clamp(texel, 0, size - 1) : min(turned, 2 * size - 1 - turned);
}

float alpha_at(uvec3 image, ivec2 texel) {
    ivec2 size = ivec2(image.yz);
    uint sampling = image.x >> 27u;
    ivec2 place = ivec2(wrapped(texel.x, size.x, sampling & 3u), wrapped(texel.y, size.y, (sampling >> 2u) & 3u));
    return texelFetch(u_alphas, int(image.x & 0x7ffffffu) + place.y * size.x + place.x).r;
}

bool solid(int mask, vec3 area) { // area: see receiver/exact.glsl
    uvec4 first = texelFetch(u_masks, 3 * mask), second = texelFetch(u_masks, 3 * mask + 1);
    uvec4 third = texelFetch(u_masks, 3 * mask + 2);
    uvec3 image = uvec3(third.z, third.w & 0xffffu, third.w >> 16u);
    vec4 ab = uintBitsToFloat(first), c = uintBitsToFloat(second);
    vec2 rest = uintBitsToFloat(third.xy);
    float whole = area.x + area.y + area.z;
    whole = whole == 0.0 ? 1.0 : whole;
    vec2 uv = (ab.xy * area.y + ab.zw * area.z + c.xy * area.x) / whole;
    float alpha = c.z + ((c.w - c.z) * area.z + (rest.x - c.z) * area.x) / whole; // exact where the three are equal
    bool nearest = (image.x >> 31u) != 0u;
    vec2 place = uv * vec2(image.yz) - (nearest ? 0.0 : 0.5);
    ivec2 texel = ivec2(floor(place));
    vec2 f = nearest ? vec2(0.0) : place - floor(place);
    float low = mix(alpha_at(image, texel), alpha_at(image, texel + ivec2(1, 0)), f.x);
    float high = mix(alpha_at(image, texel + ivec2(0, 1)), alpha_at(image, texel + ivec2(1, 1)), f.x);
    return mix(low, high, f.y) * alpha >= rest.y;
}
