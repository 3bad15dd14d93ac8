// Triangle lists of one light, one invocation per triangle: writes its facet, and a link to it into the list of every cell that it
// may touch. A triangle goes to the fine grid, or to the coarse one where it would touch more than GLS_MOST fine cells; a receiver
// walks both lists of its cell. Conservative: cells are grown by a margin that is larger than any rounding.
#ifndef GLS_SUN
#define GLS_SUN 0
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
#if GLS_POINT
#include "lib/faces.glsl"
#endif
#define GLS_FACES (GLS_POINT == 1 ? 6 : 1)
#define GLS_CULL_BACK 1u // traits of a scene's node; bits 8 on: links carry 1 + its number among masked triangles
#define GLS_CULL_FRONT 2u
#define GLS_CASTS 4u
#define GLS_CUT_OUT 8u
layout(local_size_x = 64) in;
// read as texture buffers: llvmpipe (Mesa 22.3) takes three times as long for storage buffers
uniform samplerBuffer u_positions; // world axes, relative to the scene's origin
uniform usamplerBuffer u_corners; // per triangle: vertices, node
uniform usamplerBuffer u_traits; // per node: flags, what turns a triangle's number into its mask's
layout(std430, binding = 0) writeonly buffer Facets { vec4 facets[]; };
layout(std430, binding = 1) writeonly buffer Links { uvec4 links[]; }; // triangle, next link + 1, least depth, mask + 1
layout(std430, binding = 2) buffer Counter { uint link_count; }; // runs on where the buffer is full: that is how it is noticed
layout(r32ui, binding = 0) uniform coherent uimage2D u_heads; // per face the fine cells, behind them the coarse cells of all faces
uniform mat3 u_axes; // the light's, from world axes
uniform vec3 u_origin; // of the light's frame, relative to the scene's origin
uniform int u_triangles;
uniform uint u_capacity; // links
uniform vec4 u_cells; // fine cell = xy (a sun) or tangent * u_cells.xy + u_cells.zw

const float MARGIN = 1.0 / 64.0; // fine cells: floats within the grid are exact to 2^-14 cells
const float FAR_OUT = 16.0 * float(GLS_CELLS);
const float WIDE_MARGIN = 0.25; // where the triangle crosses the light's plane and edges are found by cross products

vec3 vertex(uint i) { // in double, so that the light's frame adds one rounding, and the same to every copy of a vertex
    dvec3 p = dvec3(texelFetch(u_positions, int(i)).xyz) - dvec3(u_origin);
    return vec3(dmat3(u_axes) * p);
}

struct Edges { // of a triangle in cells: cell (x, y) may touch it where all three offset + slope.(x, y) >= 0
    mat3x2 slope;
    vec3 offset;
};

Edges grown(mat3x2 slope, vec3 offset, float margin) { // the cell's corner that lies farthest inside counts
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
    return ivec2(int(low), int(high));
}

void insert(uint triangle, uint mask, int face, vec3 a, vec3 b, vec3 c) { // vertices in the face's frame, z backward
    vec3 depth = vec3(-a.z, -b.z, -c.z);
    float nearest = min(depth.x, min(depth.y, depth.z));
#if GLS_SUN
    vec3 w = vec3(1.0);
#else
    vec3 w = 1.0 / max(depth, 1e-20);
#endif
    vec2 p = a.xy * w.x * u_cells.xy + u_cells.zw, q = b.xy * w.y * u_cells.xy + u_cells.zw, r = c.xy * w.z * u_cells.xy + u_cells.zw;
    vec2 least = min(p, min(q, r)), most = max(p, max(q, r));
#if GLS_SUN
    const bool crosses = false;
#else
    // the light's plane, or nearly: there cells of its corners are infinite, or too large for floats
    bool crosses = nearest <= 0.0 || any(lessThan(least, vec2(-FAR_OUT))) || any(greaterThan(most, vec2(FAR_OUT)));
    nearest = max(nearest, 0.0);
    least = crosses ? vec2(0.0) : least;
    most = crosses ? vec2(GLS_CELLS) : most;
#endif
    float turn = (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x) < 0.0 ? -1.0 : 1.0;
    vec3 m0 = vec3(0.0), m1 = vec3(0.0), m2 = vec3(0.0);
#if !GLS_SUN
    if (crosses) { // sides of the pyramid from the light through the triangle
        m0 = cross(a, b - a);
        m1 = cross(b, c - b);
        m2 = cross(c, a - c);
        turn = dot(m0, c) < 0.0 ? -1.0 : 1.0;
    }
#endif
    int count = 0, scale = 1;
    ivec2 first = ivec2(0), last = ivec2(0);
    Edges edges;
    for (int level = 0; level < 2; level++) {
        scale = level == 0 ? 1 : GLS_RATIO;
        float unit = 1.0 / float(scale), cells = float(GLS_CELLS / scale);
        first = ivec2(max(floor(least * unit - MARGIN), 0.0));
        last = ivec2(min(floor(most * unit + MARGIN), cells - 1.0));
        vec2 corner = vec2(first);
        if (crosses) { // direction of a cell's corner = ((cell - u_cells.zw) / u_cells.xy, -1)
            vec2 step = float(scale) / u_cells.xy, start = (corner * float(scale) - u_cells.zw) / u_cells.xy;
            edges = grown(turn * mat3x2(m0.xy * step, m1.xy * step, m2.xy * step),
                          turn * vec3(dot(m0.xy, start) - m0.z, dot(m1.xy, start) - m1.z, dot(m2.xy, start) - m2.z), WIDE_MARGIN);
        } else {
            vec2 x = p * unit - corner, y = q * unit - corner, z = r * unit - corner;
            mat3x2 slope = turn * mat3x2(x.y - y.y, y.x - x.x, y.y - z.y, z.x - y.x, z.y - x.y, x.x - z.x);
            edges = grown(slope, -vec3(dot(slope[0], x), dot(slope[1], y), dot(slope[2], z)), MARGIN);
        }
        count = 0;
        int most_cells = level == 0 ? GLS_MOST : GLS_CELLS * GLS_CELLS;
        for (int row = first.y; row <= last.y && count <= most_cells; row++) {
            ivec2 span = row_span(edges, float(row - first.y), ivec2(0, last.x - first.x));
            count += max(span.y - span.x + 1, 0);
        }
        if (count <= most_cells) break;
    }
    if (count <= 0) return;
    uint link = atomicAdd(link_count, uint(count));
    if (link + uint(count) > u_capacity) return;
    int top = scale == 1 ? face * GLS_CELLS : GLS_FACES * GLS_CELLS + face * (GLS_CELLS / GLS_RATIO);
    for (int row = first.y; row <= last.y; row++) {
        ivec2 span = row_span(edges, float(row - first.y), ivec2(0, last.x - first.x));
        for (int column = span.x; column <= span.y; column++) {
            uint next = imageAtomicExchange(u_heads, ivec2(first.x + column, top + row), link + 1u);
            links[link] = uvec4(triangle, next, floatBitsToUint(nearest), mask);
            link++;
        }
    }
}

void main() {
    uint triangle = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * (64u * 65535u);
    if (triangle >= uint(u_triangles)) return;
    uvec4 corners = texelFetch(u_corners, int(triangle));
    vec3 a = vertex(corners.x), b = vertex(corners.y), c = vertex(corners.z);
    dvec3 e = dvec3(b) - dvec3(a), f = dvec3(c) - dvec3(a);
    dvec3 product = dvec3(e.y * f.z - e.z * f.y, e.z * f.x - e.x * f.z, e.x * f.y - e.y * f.x);
    double size = dot(product, product);
    vec3 normal = size > 0.0 ? vec3(product / sqrt(size)) : vec3(0.0);
    facets[3u * triangle] = vec4(a, normal.x);
    facets[3u * triangle + 1u] = vec4(b, normal.y);
    facets[3u * triangle + 2u] = vec4(c, normal.z);
    uvec2 node = texelFetch(u_traits, int(corners.w)).xy;
    uint flags = node.x;
    uint mask = (flags & GLS_CUT_OUT) != 0u ? triangle + node.y : 0u;
#if GLS_SUN
    float side = normal.z; // > 0: its front is turned to the light
#else
    float side = -dot(normal, a) / max(length(a), 1e-30);
#endif
    const float edge_on = 1e-5; // is kept: rounding decides its side
    bool away = (flags & GLS_CULL_BACK) != 0u && side < -edge_on || (flags & GLS_CULL_FRONT) != 0u && side > edge_on;
    if (size == 0.0 || away || (flags & GLS_CASTS) == 0u) return;
#if GLS_POINT
    for (int face = 0; face < 6; face++) {
        float axis = float(face / 2), s = face % 2 == 0 ? 1.0 : -1.0;
        mat3 turned = transpose(mat3(face_right(axis, s), face_up(axis, s), face_backward(axis, s)));
        vec3 p = turned * a, q = turned * b, r = turned * c;
#else
    const int face = 0;
    vec3 p = a, q = b, r = c;
#endif
#if !GLS_SUN
        // beyond one side of the window, or behind the light; the slack, a quarter of a cell, is more than rounding
        vec3 w = vec3(-p.z, -q.z, -r.z), slack = 0.25 * abs(w);
        vec3 x = vec3(p.x, q.x, r.x) * u_cells.x + w * u_cells.z, y = vec3(p.y, q.y, r.y) * u_cells.y + w * u_cells.w;
        bool seen = any(greaterThanEqual(w, vec3(0.0))) && any(greaterThanEqual(x, -slack)) && any(greaterThanEqual(y, -slack))
            && any(lessThanEqual(x, w * float(GLS_CELLS) + slack)) && any(lessThanEqual(y, w * float(GLS_CELLS) + slack));
        if (seen)
#endif
        insert(triangle, mask, face, p, q, r);
#if GLS_POINT
    }
#endif
}
