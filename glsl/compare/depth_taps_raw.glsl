// A depth texture read as plain numbers, texel by texel: for filters that must know the depths, where nothing gathers.
#ifndef GLS_REVERSED
#define GLS_REVERSED 0
#endif
uniform highp sampler2D u_map;

float stored_at(vec2 texel) {
    return texelFetch(u_map, ivec2(texel), 0).r; // texel lies inside the map: see GLS_BOUNDED
}

float compare_one(vec2 texel, float reference) {
    float stored = stored_at(texel);
    return GLS_REVERSED == 1 ? step(stored, reference) : step(reference, stored);
}

vec4 compare_four(vec2 corner, float reference) {
    return vec4(compare_one(corner + vec2(-0.5, 0.5), reference), compare_one(corner + vec2(0.5, 0.5), reference),
                compare_one(corner + vec2(0.5, -0.5), reference), compare_one(corner + vec2(-0.5, -0.5), reference));
}
