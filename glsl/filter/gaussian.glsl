// Percentage closer filtering with a bell: bilinear comparisons one texel apart, weights 1 2 1, 1 3 4 3 1 or 1 5 12 16 12 5 1 per axis,
// fetched as (R + 1)^2 blocks of 2 x 2 texels.
// Castano 2013, "Shadow Mapping Summary", which fetches the same in R + 1 hardware-filtered taps. Twin: glshadow.shadows.filters.gaussian
#ifndef GLS_GAUSSIAN_RADIUS
#define GLS_GAUSSIAN_RADIUS 1
#endif
#if GLS_GAUSSIAN_RADIUS == 1
#define GLS_GAUSSIAN_SUM 4.0
#elif GLS_GAUSSIAN_RADIUS == 2
#define GLS_GAUSSIAN_SUM 12.0
#else
#define GLS_GAUSSIAN_SUM 52.0
#endif

#include "lib/blocks.glsl"

float bell(int i) { // weight of tap i of 2 R + 1; 0 outside
    float away = abs(float(i - GLS_GAUSSIAN_RADIUS));
#if GLS_GAUSSIAN_RADIUS == 1
    return max(2.0 - away, 0.0);
#elif GLS_GAUSSIAN_RADIUS == 2
    return max(4.0 - 0.5 * away * (away + 1.0), 0.0);
#else
    return away < 0.5 ? 16.0 : away < 1.5 ? 12.0 : away < 2.5 ? 5.0 : away < 3.5 ? 1.0 : 0.0;
#endif
}

vec2 bell_at(int i, float f) { // weights of the two texels of block i, from the two taps that read each
    float before = bell(2 * i - 1), here = bell(2 * i), after = bell(2 * i + 1);
    return vec2(here + f * (before - here), after + f * (here - after));
}

float visibility(Receiver receiver) {
    Blocks blocks = blocks_around(receiver, GLS_GAUSSIAN_RADIUS);
    float sum = 0.0;
    for (int j = 0; j <= GLS_GAUSSIAN_RADIUS; j++) {
        vec2 up = bell_at(j, blocks.f.y);
        for (int i = 0; i <= GLS_GAUSSIAN_RADIUS; i++) {
            sum += weighed(block(receiver, blocks, i, j), bell_at(i, blocks.f.x), up);
        }
    }
    return min(sum / (GLS_GAUSSIAN_SUM * GLS_GAUSSIAN_SUM), 1.0); // a fully lit area may round above 1
}
