// Alpha-tested materials of exact filters: whether a masked triangle is opaque where a ray hits it. Alpha is bilinear at the finest level,
// repeated, as GL samples it. Twin: glshadow.reference.rays.texture_alpha
uniform usamplerBuffer u_masks; // three texels per triangle: corners' texture coordinates and alpha, cutoff, image: start, width | height << 16
uniform samplerBuffer u_alphas; // alpha of all images, row 0 at v = 0

float alpha_at(uvec3 image, ivec2 texel) {
    ivec2 size = ivec2(image.yz);
    ivec2 place = texel - size * ivec2(floor(vec2(texel) / vec2(size)));
    return texelFetch(u_alphas, int(image.x) + place.y * size.x + place.x).r;
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
    vec2 place = uv * vec2(image.yz) - 0.5;
    ivec2 texel = ivec2(floor(place));
    vec2 f = place - floor(place);
    float low = mix(alpha_at(image, texel), alpha_at(image, texel + ivec2(1, 0)), f.x);
    float high = mix(alpha_at(image, texel + ivec2(0, 1)), alpha_at(image, texel + ivec2(1, 1)), f.x);
    return mix(low, high, f.y) * alpha >= rest.y;
}
