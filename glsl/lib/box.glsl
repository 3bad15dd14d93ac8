// Weights of a box filter: a row of overlapping bilinear taps reads its texels with 1 - f, 1, ..., 1, f.
#ifndef GLS_PCF_RADIUS
#define GLS_PCF_RADIUS 1
#endif
#include "lib/blocks.glsl"

vec2 box_at(int i, float f) { // of the two texels of block i
    return vec2(i == 0 ? 1.0 - f : 1.0, i == GLS_PCF_RADIUS ? f : 1.0);
}

float box_block(Receiver receiver, Blocks blocks, int i, int j) {
    return weighed(block(receiver, blocks, i, j), box_at(i, blocks.f.x), box_at(j, blocks.f.y));
}

float box_mean(float sum) {
    return min(sum / float((2 * GLS_PCF_RADIUS + 1) * (2 * GLS_PCF_RADIUS + 1)), 1.0); // a fully lit area may round above 1
}
