// A depth texture read as plain numbers, without comparison.
#ifndef GLS_REVERSED
#define GLS_REVERSED 0
#endif
uniform highp sampler2D u_map;

float stored_at(vec2 texel) {
    return texelFetch(u_map, ivec2(texel), 0).r; // the texel is inside the map: see GLS_BOUNDED
}

float compare_one(vec2 texel, float reference) {
    float stored = stored_at(texel);
    return GLS_REVERSED == 1 ? step(stored, reference) : step(reference, stored);
}
