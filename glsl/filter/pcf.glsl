// Percentage closer filtering: the mean of (2 R + 1)^2 bilinear comparisons a texel apart, fetched as (R + 1)^2 blocks of 2 x 2 texels.
// Reeves, Salesin, Cook 1987. Twin: glshadow.core.filters.pcf
#ifndef GLS_PCF_RADIUS
#define GLS_PCF_RADIUS 1
#endif
#include "lib/box.glsl"

float visibility(Receiver receiver) {
    vec2 base = floor(receiver.texel - 0.5);
    vec2 f = receiver.texel - 0.5 - base;
    vec2 first = base + (1.0 - float(GLS_PCF_RADIUS));
    float sum = 0.0;
    for (int j = 0; j <= GLS_PCF_RADIUS; j++) {
        for (int i = 0; i <= GLS_PCF_RADIUS; i++) {
            sum += box_sum(box_block(receiver, first, i, j), i, j, f);
        }
    }
    return min(sum / float((2 * GLS_PCF_RADIUS + 1) * (2 * GLS_PCF_RADIUS + 1)), 1.0); // a lit plateau may round above 1
}
