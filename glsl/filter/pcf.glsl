// Percentage closer filtering: the mean of (2 R + 1)^2 bilinear comparisons one texel apart, fetched as (R + 1)^2 blocks of 2 x 2 texels.
// Reeves, Salesin, Cook 1987. Twin: glshadow.shadows.filters.pcf
#ifndef GLS_PCF_RADIUS
#define GLS_PCF_RADIUS 1
#endif
#include "lib/box.glsl"

float visibility(Receiver receiver) {
    Blocks blocks = blocks_around(receiver, GLS_PCF_RADIUS);
    float sum = 0.0;
    for (int j = 0; j <= GLS_PCF_RADIUS; j++) {
        for (int i = 0; i <= GLS_PCF_RADIUS; i++) sum += box_block(receiver, blocks, i, j);
    }
    return box_mean(sum);
}
