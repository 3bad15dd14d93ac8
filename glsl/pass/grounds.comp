// The deepest receiver in and around each cell of the grid of pass/lists.comp, as far as any shadow moves.
#ifndef GLS_GROUNDS
#define GLS_GROUNDS 64
#endif
#ifndef GLS_POINT
#define GLS_POINT 0
#endif
layout(local_size_x = 8, local_size_y = 8) in;
uniform usampler2D u_ground; // float bits
uniform int u_around; // cells
uniform vec2 u_depths; // the least, subtracted from the grid's depths, and the greatest
layout(r32ui, binding = 0) writeonly uniform uimage2D u_out;

void main() {
    ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
    int top = cell.y / GLS_GROUNDS * GLS_GROUNDS;
    ivec2 place = ivec2(cell.x, cell.y - top);
    ivec2 low = place - u_around, high = place + u_around;
    ivec2 first = max(low, ivec2(0)), last = min(high, ivec2(GLS_GROUNDS - 1));
    uint deepest = 0u;
    for (int row = first.y; row <= last.y; row++) {
        for (int column = first.x; column <= last.x; column++) deepest = max(deepest, texelFetch(u_ground, ivec2(column, top + row), 0).r);
    }
    bool inside = low == first && high == last;
    if (GLS_POINT == 1 && !inside) deepest = floatBitsToUint(u_depths.y - u_depths.x); // other faces are not searched
    imageStore(u_out, cell, uvec4(deepest));
}
