// Blocks of 2 x 2 texels that (2 R + 1)^2 bilinear comparisons a texel apart read. A row of overlapping taps has the weights 1 - f, 1, ..., 1, f.
//
//      |  0  |  1  |  2  |  3  |    R = 1: texels of a row, two blocks; the receiver lies between the
//      +-----+-----+-----+-----+    centres of 1 and 2, f of the way
//
#ifndef GLS_PCF_RADIUS
#define GLS_PCF_RADIUS 1
#endif

// `first`: the corner in the middle of block 0, 0. The plane is followed from block to block.
vec4 box_block(Receiver receiver, vec2 first, int i, int j) {
    vec2 corner = first + 2.0 * vec2(float(i), float(j));
    return compare_four(corner, compare_depth(receiver, corner - receiver.texel));
}

float box_sum(vec4 lit, int i, int j, vec2 f) {
    float left = i == 0 ? 1.0 - f.x : 1.0;
    float right = i == GLS_PCF_RADIUS ? f.x : 1.0;
    float lower = j == 0 ? 1.0 - f.y : 1.0;
    float upper = j == GLS_PCF_RADIUS ? f.y : 1.0;
    return lower * (lit.w * left + lit.z * right) + upper * (lit.x * left + lit.y * right);
}
