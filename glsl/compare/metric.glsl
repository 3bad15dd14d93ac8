// A colour target with the depth metric, compared in the shader: the WebGL 1 path.
#include "lib/packing.glsl"
#ifndef GLS_PACKED
#define GLS_PACKED 0
#endif
#ifndef GLS_CHANNEL
#define GLS_CHANNEL 0 // of a texture that several lights share
#endif
uniform highp sampler2D u_map; // the default of ES 1.00 is lowp
uniform vec2 u_map_texel; // 1 / size of the atlas

float stored_at(vec2 texel) {
    vec4 stored = GLS_TEXTURE_2D(u_map, texel * u_map_texel);
#if GLS_PACKED
    return unpack(stored);
#else
    return stored[GLS_CHANNEL];
#endif
}

float compare_one(vec2 texel, float reference) {
#if GLS_PACKED
    // Unlike other formats it cannot hold the 1 of "at far and beyond", only 1 - 2^-24, read back with a rounding or two.
    reference = min(reference, 0.99999976); // 1 - 2^-22
#endif
    return step(reference, stored_at(texel));
}

#include "lib/four_taps.glsl"
