// What a pixel of the surface buffer says of its triangle: they are numbered from 1, the top bit marks those that no shadow falls on,
// the next those that show nothing but the shadow.
int triangle_of(uint number) { // from 0; -1: none
    return int(number & 0x3fffffffu) - 1;
}

bool is_darkened(uint number) {
    return number < 0x80000000u;
}

bool is_catcher(uint number) {
    return (number & 0x40000000u) != 0u;
}
