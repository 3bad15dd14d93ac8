// What pass/fill.frag says of a pixel's samples.
const uint MIXED = 255u; // they see several surfaces and are shaded one by one; less: one surface
const float MOST_OFF = 0.5; // pixels: how far a surface's other triangles may lie off the plane of the one that is shown

float off_plane(uint mixed) { // how far they do, in pixels; 0: all samples see the same triangle
    return MOST_OFF / float(MIXED - 1u) * float(mixed);
}

uint mixed_of(float off) {
    return uint(ceil(min(off / MOST_OFF, 1.0) * float(MIXED - 1u)));
}
