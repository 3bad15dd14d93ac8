// Copies a depth texture into one of unsigned integers: the bits of each depth, for pass/direction_maps.comp.
uniform sampler2D u_depth;
layout(location = 0) out uint o_bits;

void main() {
    o_bits = floatBitsToUint(texelFetch(u_depth, ivec2(gl_FragCoord.xy), 0).r);
}
