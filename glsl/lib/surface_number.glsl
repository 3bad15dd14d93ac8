// The triangle ID in the surface buffer: the triangle's number from 1, with flag bits above it. Twin:
// glshadow.gl.scene.geometry
const uint TRIANGLE_BITS = 0x3fffffffu;
const uint CATCHER = 0x40000000u; // shadow catcher: shows only the shadow
const uint NOT_RECEIVING = 0x80000000u; // receives no shadow
const uint MARKS = CATCHER | NOT_RECEIVING; // flags of a node

int triangle_of(uint number) { // from 0; -1: background
    return int(number & TRIANGLE_BITS) - 1;
}

bool is_darkened(uint number) {
    return (number & NOT_RECEIVING) == 0u;
}

bool is_catcher(uint number) {
    return (number & CATCHER) != 0u;
}
