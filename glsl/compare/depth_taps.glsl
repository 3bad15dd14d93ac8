// A depth texture with a comparison sampler (nearest), for drivers without textureGather on it.
uniform highp sampler2DShadow u_map;
uniform vec2 u_map_texel; // 1 / size of the atlas

float compare_one(vec2 texel, float reference) {
    return textureLod(u_map, vec3(texel * u_map_texel, reference), 0.0);
}
#include "lib/four_taps.glsl"
