// A map of means, filtered by the hardware: bilinear between texels.
uniform highp sampler2D u_map;
uniform vec2 u_map_texel; // 1 / size of the atlas

vec4 moments_at(vec2 texel) {
    return GLS_TEXTURE_2D(u_map, texel * u_map_texel);
}
