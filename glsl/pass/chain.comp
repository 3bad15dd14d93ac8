// Chains the lists of grown items that a receiver walks: the list of its cell in one grid continues with that of the next coarser grid. One
// invocation per cell; run grid after grid, from the second coarsest.
#ifndef GLS_GROWN
#define GLS_GROWN 256
#endif
layout(local_size_x = 8, local_size_y = 8) in;
layout(rgba32ui, binding = 1) writeonly uniform uimageBuffer u_joined; // u_links
uniform usamplerBuffer u_links; // a buffer texture: on llvmpipe (Mesa 22.3) three times as fast as a storage buffer
layout(r32ui, binding = 0) uniform uimage2D u_heads;
layout(std430, binding = 2) buffer Counter {
    uint link_count;
    uint wide_count;
    uint longest_list[8]; // by level
};
uniform int u_level;

int row_of(int face, int level) {
    return face * 2 * GLS_GROWN + 2 * GLS_GROWN - (2 * GLS_GROWN >> level);
}

void main() {
    int cells = GLS_GROWN >> u_level;
    ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
    int face = cell.y / cells;
    cell.y -= face * cells;
    uint rest = imageLoad(u_heads, cell / 2 + ivec2(0, row_of(face, u_level + 1))).r;
    if (rest == 0u) return;
    ivec2 place = cell + ivec2(0, row_of(face, u_level));
    uint link = imageLoad(u_heads, place).r;
    if (link == 0u) {
        imageStore(u_heads, place, uvec4(rest));
        return;
    }
    uint count = 1u;
    uvec4 last = texelFetch(u_links, int(link) - 1);
    while (last.y != 0u) {
        link = last.y;
        last = texelFetch(u_links, int(link) - 1);
        count++;
    }
    atomicMax(longest_list[u_level], count);
    last.y = rest;
    imageStore(u_joined, int(link) - 1, last);
}
