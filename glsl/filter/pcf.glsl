// Percentage closer filtering: the mean of (2 R + 1)^2 bilinear comparisons a texel apart, fetched as (R + 1)^2 blocks of 2 x 2 texels.
// A row of overlapping bilinear taps has the weights 1 - f, 1, ..., 1, f. The plane is followed from block to block.
//
//      |  0  |  1  |  2  |  3  |    R = 1: texels of a row, two blocks; the receiver lies between the
//      +-----+-----+-----+-----+    centres of 1 and 2, f of the way
//
// Reeves, Salesin, Cook 1987. Twin: glshadow.core.filters.pcf
#ifndef GLS_PCF_RADIUS
#define GLS_PCF_RADIUS 1
#endif

float visibility(Receiver receiver) {
    vec2 base = floor(receiver.texel - 0.5);
    vec2 f = receiver.texel - 0.5 - base;
    vec2 first = base + (1.0 - float(GLS_PCF_RADIUS)); // corner in the middle of the first block
    float sum = 0.0;
    for (int j = 0; j <= GLS_PCF_RADIUS; j++) {
        for (int i = 0; i <= GLS_PCF_RADIUS; i++) {
            vec2 corner = first + 2.0 * vec2(float(i), float(j));
            vec4 lit = compare_four(corner, compare_depth(receiver, corner - receiver.texel));
            float left = i == 0 ? 1.0 - f.x : 1.0;
            float right = i == GLS_PCF_RADIUS ? f.x : 1.0;
            float lower = j == 0 ? 1.0 - f.y : 1.0;
            float upper = j == GLS_PCF_RADIUS ? f.y : 1.0;
            sum += lower * (lit.w * left + lit.z * right) + upper * (lit.x * left + lit.y * right);
        }
    }
    return min(sum / float((2 * GLS_PCF_RADIUS + 1) * (2 * GLS_PCF_RADIUS + 1)), 1.0); // a lit plateau may round above 1
}
