// One bilinear comparison at an offset in texels from the receiver, the plane followed to the four texels. Needs <compare> and <depth>.
float bilinear_tap(Receiver receiver, vec2 offset) {
    vec2 place = receiver.texel + offset - 0.5;
    vec2 base = floor(place);
    vec2 f = place - base;
    vec4 lit = compare_four(base + 1.0, compare_depth(receiver, base + 1.0 - receiver.texel));
    vec2 lower = vec2(lit.w, lit.z), upper = vec2(lit.x, lit.y);
    vec2 row = lower + f.y * (upper - lower);
    return row.x + f.x * (row.y - row.x);
}
