// What a pixel of the surface buffer says of its triangle: they are numbered from 1; above the number there are marks. Twin:
// glshadow.gl.scene.geometry
const uint TRIANGLE_BITS = 0x07ffffffu;
const uint CUT_OUT_NODE = 0x08000000u; // a texture cuts it out
const uint MISSED = 0x10000000u; // the pixel's ray meets neither it nor one near it: see pass/primary.frag
const uint MOVED = 0x20000000u; // the ray meets it, though GL drew another one: its depth is not in the depth buffer
const uint CATCHER = 0x40000000u; // it shows nothing but the shadow
const uint NOT_RECEIVING = 0x80000000u; // no shadow falls on it
const uint MARKS = CATCHER | NOT_RECEIVING; // of a node, which change what is shown

int triangle_of(uint number) { // from 0; -1: none
    return int(number & TRIANGLE_BITS) - 1;
}

bool is_darkened(uint number) {
    return (number & NOT_RECEIVING) == 0u;
}

bool is_catcher(uint number) {
    return (number & CATCHER) != 0u;
}

bool is_cut_out(uint number) {
    return (number & CUT_OUT_NODE) != 0u;
}

bool is_missed(uint number) {
    return (number & MISSED) != 0u;
}

bool is_moved(uint number) {
    return (number & MOVED) != 0u;
}
