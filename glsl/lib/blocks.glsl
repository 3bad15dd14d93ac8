// Blocks of 2 x 2 texels, (R + 1)^2 of them, that (2 R + 1)^2 bilinear comparisons one texel apart read. The plane is followed per block.
//
//      |  0  |  1  |  2  |  3  |    R = 1: texels of a row, two blocks; the receiver lies between the
//      +-----+-----+-----+-----+    centres of 1 and 2, f of the way
//
struct Blocks {
    vec2 first; // corner at the centre of block 0, 0
    vec2 f;
};

Blocks blocks_around(Receiver receiver, int radius) {
    vec2 base = floor(receiver.texel - 0.5);
    return Blocks(base + (1.0 - float(radius)), receiver.texel - 0.5 - base);
}

vec4 block(Receiver receiver, Blocks blocks, int i, int j) {
    vec2 corner = blocks.first + 2.0 * vec2(float(i), float(j));
    return compare_four(corner, compare_depth(receiver, corner - receiver.texel));
}

// The outcomes of a block, weighted for its left and right, lower and upper texels.
float weighed(vec4 lit, vec2 across, vec2 up) {
    return up.x * (lit.w * across.x + lit.z * across.y) + up.y * (lit.x * across.x + lit.y * across.y);
}
