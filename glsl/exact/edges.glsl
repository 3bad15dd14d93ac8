// Whether the samples of a pixel may see a light differently: whether a silhouette edge of a caster crosses the pixel's footprint, as seen
// from the light. Between a lit and a dark sample there is such an edge; without one all samples have the same visibility. GLS_SOFT: for
// area lights only edges whose penumbra is not much wider than the footprint count, since across a wide penumbra one sample is close to
// the mean. Needs lib/pixel_footprint.glsl, lib/facet.glsl; GLS_SOFT: lib/cone.glsl.
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_POINT
#define GLS_POINT 0
#endif
#ifndef GLS_CELLS
#define GLS_CELLS 512
#endif
#ifndef GLS_SOFT
#define GLS_SOFT 0
#endif
#ifndef GLS_MASKED
#define GLS_MASKED 0
#endif
#ifndef GLS_EDGE_CELLS
#define GLS_EDGE_CELLS 512
#endif
#include "lib/edge_grids.glsl"
uniform usampler2D u_edge_heads;
uniform usamplerBuffer u_edge_links;
const float SHARP = 3.0; // radii of the footprint: wider blur is a penumbra
const float ROUNDING = 1e-3; // of the footprint's radius

float cross2(vec2 a, vec2 b) {
    return a.x * b.y - a.y * b.x;
}

// Whether a segment comes nearer than `reach` to the parallelogram of half vectors u, v about the origin, by separating axes. One end may
// be so far away that sums of both ends would lose the precision of the other.
bool crosses(vec2 a, vec2 b, vec2 u, vec2 v, float reach) {
    vec2 d = b - a, of_u = vec2(cross2(a, u), cross2(b, u)), of_v = vec2(cross2(a, v), cross2(b, v));
    float area = abs(cross2(u, v)), beside_u = area + reach * length(u), beside_v = area + reach * length(v), along = reach * length(d);
    return min(of_u.x, of_u.y) <= beside_u && max(of_u.x, of_u.y) >= -beside_u
        && min(of_v.x, of_v.y) <= beside_v && max(of_v.x, of_v.y) >= -beside_v
        && abs(cross2(a, b)) <= abs(cross2(u, d)) + abs(cross2(v, d)) + along
        && max(dot(a, d), -dot(b, d)) <= abs(dot(u, d)) + abs(dot(v, d)) + along;
}

bool edge_in(PixelFootprint f, bool facing) { // facing: the receiver's plane faces the light
    vec3 position = f.middle, right = f.right, up = f.up, aside = f.aside;
    int top = 0;
#if GLS_POINT
    float axis = face_axis(position), s = face_side(position, axis);
    mat3 face = transpose(mat3(face_right(axis, s), face_up(axis, s), face_backward(axis, s)));
    top = int(face_number(axis, s)) * EDGE_ROWS;
    position = face * position;
    right = face * right;
    up = face * up;
    aside = face * aside;
#define IN_FACE(v) (face * (v))
#else
#define IN_FACE(v) (v)
#endif
    float depth = -position.z, deeper = abs(right.z) + abs(up.z) + abs(aside.z);
#if GLS_AT_INFINITY
    vec2 place = position.xy, u = right.xy, v = up.xy, w = aside.xy;
    bool open = f.open;
#else
    vec2 place = position.xy / depth;
    float grown = 1.0 / (1.0 - min(deeper / depth, MOST_FORESHORTENED));
    bool open = f.open || !(deeper < MOST_FORESHORTENED * depth);
    vec2 u = (right.xy + place * right.z) * (grown / depth), v = (up.xy + place * up.z) * (grown / depth);
    vec2 w = (aside.xy + place * aside.z) * (grown / depth);
#endif
    float radius = length(abs(u) + abs(v));
    float sharp = GLS_SOFT == 1 ? SHARP * radius : 0.0, beside = ROUNDING * radius + length(w);
    const float finest = float(GLS_EDGE_CELLS) / float(GLS_CELLS);
    vec2 cell = (place * u_cells.xy + u_cells.zw) * finest;
    vec2 extent = (abs(u) + abs(v) + beside + sharp) * u_cells.xy * finest;
    float cells = float(GLS_EDGE_CELLS);
    bool inside = (depth > 0.0 || GLS_AT_INFINITY == 1) && !f.mixed;
#if !GLS_POINT
    inside = inside && all(greaterThan(cell + extent, vec2(0.0))) && all(lessThan(cell - extent, vec2(cells)));
#endif
    float reach = max(extent.x, extent.y);
    int grid = int(clamp(ceil(0.5 * log2(max(2.0 * reach, 1e-6))), 0.0, float(EDGE_GRIDS)));
    open = open || grid == EDGE_GRIDS;
    grid = min(grid, EDGE_GRIDS - 1);
    ivec2 at = clamp(ivec2(cell) >> (2 * grid), ivec2(0), ivec2((GLS_EDGE_CELLS >> (2 * grid)) - 1));
    uint link = texelFetch(u_edge_heads, at + ivec2(0, top + (4 * GLS_EDGE_CELLS - (GLS_EDGE_CELLS >> (2 * grid) << 2)) / 3), 0).r;
#if !GLS_AT_INFINITY && !GLS_POINT
    open = open || any(lessThan(min(abs(cell), abs(cell - cells)), extent)); // beyond the window casters are unknown
#endif
    bool found = inside && open;
    link = inside && !open ? link : 0u;
    float slack = MOST_OFF * f.pixel;
    while (link != 0u) {
        uvec4 entry = texelFetch(u_edge_links, int(link) - 1);
        link = entry.y;
        if (uintBitsToFloat(entry.z) > depth + deeper) continue;
        int item = 3 * int(entry.x), edge = int(entry.w) % 3;
        vec3 a = texelFetch(u_facets, item + edge).xyz, b = texelFetch(u_facets, item + (edge + 1) % 3).xyz;
        float high = dot(f.normal, a - f.middle), higher = dot(f.normal, b - f.middle);
        bool between = facing ? max(high, higher) >= -slack : min(abs(high), abs(higher)) <= slack || (high < 0.0) != (higher < 0.0);
        a = IN_FACE(a);
        b = IN_FACE(b);
        float blur = beside;
#if GLS_AT_INFINITY
        vec2 p = a.xy - place, q = b.xy - place;
#if GLS_SOFT
        vec2 away = u_radius * max(depth + vec2(a.z, b.z), 0.0);
#endif
#else
        float most = max(-a.z, -b.z), low = 1e-4 * most;
        between = between && most > 0.0;
        vec3 a_ = -a.z < low ? mix(a, b, (low + a.z) / (a.z - b.z)) : a, b_ = -b.z < low ? mix(b, a, (low + b.z) / (b.z - a.z)) : b;
        vec2 p = (a_.xy + place * a_.z) / -a_.z, q = (b_.xy + place * b_.z) / -b_.z;
#if GLS_SOFT
        vec2 away = u_radius * max(-1.0 / vec2(a_.z, b_.z) - 1.0 / depth, 0.0) * length(vec3(place, 1.0));
#endif
#endif
#if GLS_SOFT
        between = between && min(away.x, away.y) <= sharp;
        blur += min(max(away.x, away.y), sharp);
#endif
        bool hit = crosses(p, q, u, v, blur);
#if GLS_MASKED
        if (entry.w == 3u) {
            vec3 c = texelFetch(u_facets, item + 2).xyz;
            between = between || facing && dot(f.normal, c - f.middle) >= -slack;
            c = IN_FACE(c);
#if GLS_AT_INFINITY
            vec2 r = c.xy - place;
#else
            between = between && c.z < 0.0;
            vec2 r = (c.xy + place * c.z) / -c.z;
#endif
            hit = hit || crosses(q, r, u, v, blur) || crosses(r, p, u, v, blur) || met(vec3(cross2(p, q), cross2(q, r), cross2(r, p)));
        }
#endif
        if (between && hit) {
            found = true;
            link = 0u;
        }
    }
    return found;
}
