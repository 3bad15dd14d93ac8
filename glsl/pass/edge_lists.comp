// Silhouette edges into grids of per-cell lists, one invocation per edge: into each cell of each grid that is nearer than half a cell.
// A footprint with a radius of up to half a cell so meets only edges of its centre's cell. See exact/edges.glsl.
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_CELLS
#define GLS_CELLS 512
#endif
#ifndef GLS_EDGE_CELLS
#define GLS_EDGE_CELLS 512
#endif
#include "lib/edge_grids.glsl"
#include "lib/cells.glsl"
#include "lib/facet.glsl"
#include "lib/traits.glsl"
layout(local_size_x = 64) in;
uniform usamplerBuffer u_edges; // see pass/edges.comp
const float HALF = 0.5;

void main() {
    uint number = own_triangle();
    if (number >= u_part.y) return;
    uint edge = texelFetch(u_edges, int(number)).r, code = edge & 3u;
    Facet own = facet(int(edge >> 2u));
    vec3 a = code == 1u ? own.b : code == 2u ? own.c : own.a, b = code == 0u ? own.b : code == 2u ? own.a : code == 1u ? own.c : own.b;
    vec3 c = code == 3u ? own.c : b;
    const float fine = float(GLS_CELLS) / float(GLS_EDGE_CELLS);
    for (int face = 0; face < FACES; face++) {
        mat3 turned = face_from_lv(face);
        Footprint f = footprint(turned * a, turned * b, turned * c);
        if (max(f.depth.x, max(f.depth.y, f.depth.z)) <= 0.0 && GLS_AT_INFINITY == 0) continue;
        int top = face * EDGE_ROWS;
        for (int grid = 0; grid < EDGE_GRIDS; grid++) {
            int cells = GLS_EDGE_CELLS >> (2 * grid);
            float scale = fine * float(1 << (2 * grid));
            Block block_ = block(f, scale, float(cells), HALF * scale);
            for (int row = block_.first.y; row <= block_.last.y; row++) {
                ivec2 span = row_span(block_.edges, float(row - block_.first.y), ivec2(0, block_.last.x - block_.first.x));
                int count = max(span.y - span.x + 1, 0);
                uint link = atomicAdd(link_count, uint(count));
                if (link + uint(count) > u_capacity) continue;
                for (int column = span.x; column <= span.y; column++) {
                    put(link, ivec2(block_.first.x + column, top + row), edge >> 2u, f.nearest, code);
                    link++;
                }
            }
            top += cells;
        }
    }
}
