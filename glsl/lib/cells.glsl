// Links to items in per-cell lists: an item is linked in all fine cells that it may overlap, or in coarse cells if it would overlap more
// than GLS_MOST fine ones; a receiver walks the lists of its fine and its coarse cell. Conservative: cells are enlarged by more than any
// rounding. See exact/lists.glsl, which walks the lists.
//
// GLS_AREA: for an area light items may also go into grids of grown items, each into few cells of the grid whose cells are as large as the
// item and the whole movement of its shadow; a receiver walks one list of each grid. See exact/grown.glsl.
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_POINT
#define GLS_POINT 0
#endif
#ifndef GLS_CELLS
#define GLS_CELLS 512 // along a side of the fine grid
#endif
#ifndef GLS_RATIO
#define GLS_RATIO 16 // fine cells along a side of a coarse one
#endif
#ifndef GLS_MOST
#define GLS_MOST 256
#endif
#ifndef GLS_PLACES_GROWN
#define GLS_PLACES_GROWN 0 // 1: fills grids of grown items
#endif
#ifndef GLS_AREA
#define GLS_AREA 0 // 1: area light
#endif
#ifndef GLS_CAPSULES
#define GLS_CAPSULES 0 // 1: the scene has balls; 2: also tubes
#endif
#if GLS_POINT
#include "lib/faces.glsl"
#endif
const int FACES = GLS_POINT == 1 ? 6 : 1;
layout(std430, binding = 1) writeonly buffer Links { uvec4 links[]; }; // item, next link + 1, least depth of receivers, user data
layout(std430, binding = 2) buffer Counter {
    uint link_count; // keeps counting when the buffer is full, which reveals the overflow
    uint wide_count; // items in the coarsest grid of grown ones
};
layout(r32ui, binding = 0) uniform coherent uimage2D u_heads; // for each face its fine cells, then the coarse cells of all faces
uniform uint u_capacity; // capacity of the part, in links
uniform uint u_first_link; // index of the part's first link
uniform vec4 u_cells; // fine cell = xy (directional light) or tangent * u_cells.xy + u_cells.zw
#if GLS_AREA
#ifndef GLS_GROUNDS
#define GLS_GROUNDS 64 // cells along a side of the grid of the deepest receivers
#endif
#ifndef GLS_GROWN
#define GLS_GROWN 256 // cells along a side of the finest grid of grown items
#endif
#ifndef GLS_LEVELS
#define GLS_LEVELS 6 // grids of grown items, each half as fine as the last
#endif
uniform float u_radius; // radius of the light: a tangent (directional light), or world units
uniform vec2 u_depths; // of all receivers: the least, subtracted from those in the grid, and the greatest
#endif

const float MARGIN = 1.0 / 64.0; // fine cells: floats within the grid are exact to 2^-14 cells
const float FAR_OUT = 16.0 * float(GLS_CELLS);
const float WIDE_MARGIN = 0.25; // for items that cross the light's plane, whose edges come from cross products

struct Edges { // of a triangle in cells: cell (x, y) may touch it where all three offset + slope.(x, y) >= 0
    mat3x2 slope;
    vec3 offset;
};

Edges grown(mat3x2 slope, vec3 offset, float margin) { // tests the corner of the cell that is farthest inside
    for (int i = 0; i < 3; i++) {
        offset[i] += dot(max(slope[i], 0.0), vec2(1.0)) + margin * dot(abs(slope[i]), vec2(1.0));
    }
    return Edges(slope, offset);
}

ivec2 row_span(Edges edges, float y, ivec2 span) { // first and last cell of row y that may be touched, within span
    float low = float(span.x), high = float(span.y);
    for (int i = 0; i < 3; i++) {
        float slope = edges.slope[i].x, rest = edges.offset[i] + edges.slope[i].y * y;
        float x = -rest / slope;
        low = slope > 0.0 ? max(low, ceil(x)) : low;
        high = slope < 0.0 ? min(high, floor(x)) : high;
        high = slope == 0.0 && rest < 0.0 ? -1.0 : high;
    }
    // converting a float out of an int's range gives any value: the least one on llvmpipe
    return ivec2(int(min(low, float(span.y) + 1.0)), int(max(high, float(span.x) - 1.0)));
}

#if GLS_AREA
float gap(vec2 at, vec2 a, vec2 b) { // distance to a segment
    vec2 along = b - a;
    float length2 = dot(along, along);
    return distance(at, a + along * (length2 > 0.0 ? clamp(dot(at - a, along) / length2, 0.0, 1.0) : 0.0));
}

float spread_at(float nearest, float slant, float ground) { // fine cells by which the light's size moves a shadow on the ground
    float unit = max(u_cells.x, u_cells.y);
#if GLS_AT_INFINITY
    return u_radius * max(ground - nearest, 0.0) * unit;
#else
    return nearest > u_radius ? u_radius * slant * max(1.0 - nearest / ground, 0.0) / (nearest - u_radius) * unit : FAR_OUT;
#endif
}

float least_depth(float nearest, float slant, float away) { // of receivers at this distance in fine cells that see the light past the item
    float unit = max(u_cells.x, u_cells.y);
#if GLS_AT_INFINITY
    return nearest + away / (u_radius * unit);
#else
    float share = away * (nearest - u_radius) / (u_radius * slant * unit);
    return nearest > u_radius ? (share < 1.0 ? nearest / (1.0 - share) : 1e38) : 0.0;
#endif
}
#endif

// Whether a triangle may lie between the window and a light of some radius: not if it is beyond one side of the window, or behind the
// light. The slack, a quarter of a cell, exceeds rounding.
bool near_window(vec3 a, vec3 b, vec3 c, float radius) {
#if GLS_AT_INFINITY
    return true;
#else
    vec3 w = vec3(-a.z, -b.z, -c.z), slack = 0.25 * abs(w);
    vec3 x = vec3(a.x, b.x, c.x) * u_cells.x + w * u_cells.z, y = vec3(a.y, b.y, c.y) * u_cells.y + w * u_cells.w;
    const float cells = float(GLS_CELLS);
    vec4 reach = radius * vec4(length(u_cells.xz), length(vec2(u_cells.x, u_cells.z - cells)), length(u_cells.yw),
                               length(vec2(u_cells.y, u_cells.w - cells)));
    return any(greaterThanEqual(w, vec3(-radius))) && any(greaterThanEqual(x, -slack - reach.x))
        && any(lessThanEqual(x, w * cells + slack + reach.y)) && any(greaterThanEqual(y, -slack - reach.z))
        && any(lessThanEqual(y, w * cells + slack + reach.w));
#endif
}

mat3 face_from_lv(int face) { // of a point light; other lights have a single face
#if GLS_POINT
    float axis = float(face / 2), s = face % 2 == 0 ? 1.0 : -1.0;
    return transpose(mat3(face_right(axis, s), face_up(axis, s), face_backward(axis, s)));
#else
    return mat3(1.0);
#endif
}

struct Footprint { // of a triangle in a face
    vec2 p; // corners in fine cells
    vec2 q;
    vec2 r;
    vec3 depth;
    float nearest;
    float slant;
    bool crosses; // the light's plane, or nearly: its corners' cells are then infinite or too large for floats
    mat3 sides; // then: of the pyramid from the light through the triangle
    vec2 least;
    vec2 most;
#if GLS_CAPSULES
    bool round_; // a capsule: its depth, nearest, least and most, and the sides of the strip around it
#endif
};

Footprint footprint(vec3 a, vec3 b, vec3 c) { // vertices in the face's frame, z backward
    Footprint f;
    f.depth = vec3(-a.z, -b.z, -c.z);
    f.nearest = min(f.depth.x, min(f.depth.y, f.depth.z));
#if GLS_AT_INFINITY
    vec3 w = vec3(1.0);
#else
    vec3 w = 1.0 / max(f.depth, 1e-20);
#endif
    f.p = a.xy * w.x * u_cells.xy + u_cells.zw;
    f.q = b.xy * w.y * u_cells.xy + u_cells.zw;
    f.r = c.xy * w.z * u_cells.xy + u_cells.zw;
    f.least = min(f.p, min(f.q, f.r));
    f.most = max(f.p, max(f.q, f.r));
    f.slant = 1.0;
#if GLS_CAPSULES
    f.round_ = false;
#endif
    f.crosses = false;
    f.sides = mat3(0.0);
#if !GLS_AT_INFINITY
    f.crosses = f.nearest <= 0.0 || any(lessThan(f.least, vec2(-FAR_OUT))) || any(greaterThan(f.most, vec2(FAR_OUT)));
    f.nearest = max(f.nearest, 0.0);
#if GLS_AREA
    vec2 tangent = max(abs(a.xy * w.x), max(abs(b.xy * w.y), abs(c.xy * w.z)));
    f.slant = f.crosses ? 1.0 : sqrt(1.0 + dot(tangent, tangent));
#endif
    if (f.crosses) {
        f.least = vec2(0.0);
        f.most = vec2(GLS_CELLS);
        f.sides = mat3(cross(a, b - a), cross(b, c - b), cross(c, a - c));
        f.sides *= dot(f.sides[0], c) < 0.0 ? -1.0 : 1.0;
    }
#endif
    return f;
}

struct Block { // of cells that an item may overlap
    ivec2 first;
    ivec2 last;
    Edges edges;
};

Block block(Footprint f, float scale, float cells, float spread) { // scale: fine cells along a side of one
    Block b;
    float margin = spread / scale + MARGIN;
    b.first = ivec2(clamp(floor(f.least / scale - margin), 0.0, cells));
    b.last = max(ivec2(clamp(floor(f.most / scale + margin), -1.0, cells - 1.0)), b.first - 1); // no cells: the one before the first
    vec2 corner = vec2(b.first);
#if GLS_CAPSULES
    if (f.round_) {
        vec2 step = scale / u_cells.xy, start = (corner * scale - u_cells.zw) / u_cells.xy;
        b.edges = grown(mat3x2(f.sides[0].xy * step, f.sides[1].xy * step, vec2(0.0)),
                        vec3(dot(f.sides[0].xy, start) + f.sides[0].z, dot(f.sides[1].xy, start) + f.sides[1].z, 0.0), margin);
        return b;
    }
#endif
    if (f.crosses) { // direction of a cell's corner = ((cell - u_cells.zw) / u_cells.xy, -1)
        vec2 step = scale / u_cells.xy, start = (corner * scale - u_cells.zw) / u_cells.xy;
        b.edges = grown(mat3x2(f.sides[0].xy * step, f.sides[1].xy * step, f.sides[2].xy * step),
                        vec3(dot(f.sides[0].xy, start) - f.sides[0].z, dot(f.sides[1].xy, start) - f.sides[1].z,
                             dot(f.sides[2].xy, start) - f.sides[2].z), spread / scale + WIDE_MARGIN);
    } else {
        float turn = (f.q.x - f.p.x) * (f.r.y - f.p.y) - (f.q.y - f.p.y) * (f.r.x - f.p.x) < 0.0 ? -1.0 : 1.0;
        vec2 x = f.p / scale - corner, y = f.q / scale - corner, z = f.r / scale - corner;
        mat3x2 slope = turn * mat3x2(x.y - y.y, y.x - x.x, y.y - z.y, z.x - y.x, z.y - x.y, x.x - z.x);
        b.edges = grown(slope, -vec3(dot(slope[0], x), dot(slope[1], y), dot(slope[2], z)), margin);
    }
    return b;
}

int cells_of(Block b, int enough) {
    int count = 0;
    for (int row = b.first.y; row <= b.last.y && count <= enough; row++) {
        ivec2 span = row_span(b.edges, float(row - b.first.y), ivec2(0, b.last.x - b.first.x));
        count += max(span.y - span.x + 1, 0);
    }
    return count;
}

void put(uint link, ivec2 cell, uint item, float depth, uint rest) {
    uint next = imageAtomicExchange(u_heads, cell, u_first_link + link + 1u);
    links[link] = uvec4(item, next, floatBitsToUint(depth), rest);
}

const int COARSE_TOP = FACES * GLS_CELLS, COARSE = GLS_CELLS / GLS_RATIO; // first row of coarse cells, and their number along a face

void insert(uint item, uint rest, int face, Footprint f) {
    int scale = 1;
    Block b;
    int count = 0;
    for (int level = 0; level < 2; level++) {
        scale = level == 0 ? 1 : GLS_RATIO;
        b = block(f, float(scale), float(GLS_CELLS / scale), 0.0);
        int most = level == 0 ? GLS_MOST : GLS_CELLS * GLS_CELLS;
        count = cells_of(b, most);
        if (count <= most) break;
    }
    if (count <= 0) return;
    uint link = atomicAdd(link_count, uint(count));
    if (link + uint(count) > u_capacity) return;
    int top = scale == 1 ? face * GLS_CELLS : COARSE_TOP + face * COARSE;
    for (int row = b.first.y; row <= b.last.y; row++) {
        ivec2 span = row_span(b.edges, float(row - b.first.y), ivec2(0, b.last.x - b.first.x));
        for (int column = span.x; column <= span.y; column++) {
            put(link, ivec2(b.first.x + column, top + row), item, f.nearest, rest);
            link++;
        }
    }
}

#if GLS_AREA
#if GLS_PLACES_GROWN
uniform usampler2D u_ground_around; // maximum of u_grounds around each cell, as far as any shadow moves
uniform usampler2D u_ground; // u_grounds

float ground_at(usampler2D grounds, ivec2 cell, int face) {
    return u_depths.x + uintBitsToFloat(texelFetch(grounds, cell + ivec2(0, face * GLS_GROUNDS), 0).r);
}

// Links the item in all cells where it may lie between a receiver and some part of the light, with the least depth of those receivers.
void insert_grown(uint item, uint rest, int face, Footprint f, bool edge) {
    const float ground_scale = float(GLS_CELLS) / float(GLS_GROUNDS), fine = float(GLS_CELLS) / float(GLS_GROWN);
    bool anywhere = GLS_AT_INFINITY == 0 && (f.crosses || f.nearest <= u_radius); // the cells are unknown
    if (f.crosses) {
        f.sides = mat3(0.0);
        f.nearest = 0.0;
    }
    float ground = u_depths.y;
    ivec2 first = clamp(ivec2(f.least / ground_scale), ivec2(0), ivec2(GLS_GROUNDS - 1));
    ivec2 last = clamp(ivec2(f.most / ground_scale), ivec2(0), ivec2(GLS_GROUNDS - 1));
    if (!anywhere && all(lessThan(last - first, ivec2(4)))) {
        ground = u_depths.x;
        for (int row = first.y; row <= last.y; row++) {
            for (int column = first.x; column <= last.x; column++) ground = max(ground, ground_at(u_ground_around, ivec2(column, row), face));
        }
    }
    float spread = anywhere ? FAR_OUT : min(spread_at(f.nearest, f.slant, ground), FAR_OUT);
    if (!anywhere && f.nearest > ground) return;
    if (any(greaterThan(f.least - spread - MARGIN, vec2(GLS_CELLS))) || any(lessThan(f.most + spread + MARGIN, vec2(0.0)))) return;
    vec2 extent = f.most - f.least + 2.0 * (spread + MARGIN);
    int level = int(clamp(ceil(log2(max(max(extent.x, extent.y) / fine, 1.0) * 0.25)), 0.0, float(GLS_LEVELS - 1)));
    float scale = fine * float(1 << level);
    Block b = block(f, scale, float(GLS_GROWN >> level), spread);
    if (level == GLS_LEVELS - 1) atomicAdd(wide_count, 1u);
    int top = face * 2 * GLS_GROWN + 2 * GLS_GROWN - (2 * GLS_GROWN >> level);
    for (int row = b.first.y; row <= b.last.y; row++) {
        ivec2 span = row_span(b.edges, float(row - b.first.y), ivec2(0, b.last.x - b.first.x));
        for (int column = span.x; column <= span.y; column++) {
            ivec2 cell = ivec2(b.first.x + column, row);
            vec2 middle = (vec2(cell) + 0.5) * scale;
            float away = edge ? gap(middle, f.p, f.q) : length(max(max(f.least - middle, middle - f.most), 0.0));
            float depth = anywhere ? 0.0 : least_depth(f.nearest, f.slant, max(away - (0.708 * scale + MARGIN), 0.0));
            float there = ground;
            if (scale <= ground_scale) there = min(there, ground_at(u_ground, ivec2(middle / ground_scale), face));
            if (anywhere || depth <= there) {
                uint link = atomicAdd(link_count, 1u);
                if (link < u_capacity) put(link, cell + ivec2(0, top), item, depth, rest);
            }
        }
    }
}
#endif

#if !GLS_PLACES_GROWN
layout(r32ui, binding = 1) uniform coherent uimage2D u_grounds; // float bits

float aside_by(float lift, Footprint f) { // fine cells
    float unit = max(u_cells.x, u_cells.y);
#if GLS_AT_INFINITY
    return lift * unit;
#else
    return f.nearest > 2.0 * lift ? 2.0 * lift * f.slant / (f.nearest - lift) * unit : lift > 0.0 ? FAR_OUT : 0.0;
#endif
}

void deepen(int face, Footprint f, float lift) { // updates all cells in which a receiver up to lift off the triangle may be
    const float scale = float(GLS_CELLS) / float(GLS_GROUNDS);
    float deepest = max(f.depth.x, max(f.depth.y, f.depth.z)), aside = aside_by(lift, f);
    Block b = block(f, scale, float(GLS_GROUNDS), aside);
    vec2 x = f.p / scale, e = f.q / scale - x, g = f.r / scale - x;
#if GLS_AT_INFINITY
    vec3 d = f.depth;
#else
    vec3 d = -1.0 / max(f.depth, 1e-20); // linear over the face
#endif
    float turn = e.x * g.y - e.y * g.x;
    bool slanted = !f.crosses && turn * turn > 1e-10 * dot(e, e) * dot(g, g); // else seen edge-on
    vec2 slope = vec2((d.y - d.x) * g.y - (d.z - d.x) * e.y, (d.z - d.x) * e.x - (d.y - d.x) * g.x) / (slanted ? turn : 1.0);
    for (int row = b.first.y; row <= b.last.y; row++) {
        ivec2 span = row_span(b.edges, float(row - b.first.y), ivec2(0, b.last.x - b.first.x));
        for (int column = span.x; column <= span.y; column++) {
            ivec2 cell = ivec2(b.first.x + column, row);
            float there = d.x + dot(slope, vec2(cell) + 0.5 - x) + (0.5 + MARGIN + aside / scale) * dot(abs(slope), vec2(1.0));
#if !GLS_AT_INFINITY
            there = there < 0.0 ? -1.0 / there : 1e38;
#endif
            float depth = slanted ? min(there, deepest) : deepest;
            depth += 1e-5 * abs(depth) + lift;
            imageAtomicMax(u_grounds, cell + ivec2(0, face * GLS_GROUNDS), floatBitsToUint(max(depth - u_depths.x, 0.0)));
        }
    }
}
#endif
#endif
