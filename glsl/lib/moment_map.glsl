// A prefiltered moment map, sampled with hardware filtering: bilinear between texels, and between mip levels if there are any.
#ifndef GLS_MIP_LEVELS
#define GLS_MIP_LEVELS 0
#endif
uniform highp sampler2D u_map;
uniform vec2 u_map_texel; // 1 / size of the atlas

vec4 moments_at(Receiver receiver) {
#if GLS_MIP_LEVELS
    return textureLod(u_map, receiver.texel * u_map_texel, receiver.level);
#else
    return GLS_TEXTURE_2D(u_map, receiver.texel * u_map_texel);
#endif
}
