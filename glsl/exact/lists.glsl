// Slot <candidates>: the links of the receiver's fine cell, then those of its coarse cell. See pass/lists.comp.
#ifndef GLS_CAPSULES
#define GLS_CAPSULES 0 // 1: the scene has balls; 2: also tubes
#endif
#ifndef GLS_CELLS
#define GLS_CELLS 512
#endif
#ifndef GLS_RATIO
#define GLS_RATIO 16
#endif
#ifndef GLS_POINT
#define GLS_POINT 0
#endif
#define GLS_FACES (GLS_POINT == 1 ? 6 : 1)
#ifndef GLS_MARKS
#define GLS_MARKS 0
#endif
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_MASKED
#define GLS_MASKED 0 // some casters are cut out by their texture
#endif
#if GLS_CAPSULES
#include "exact/capsules.glsl"
#endif
#if GLS_MASKED
#include "lib/mask.glsl"
#endif
uniform usampler2D u_heads;
uniform usamplerBuffer u_links;

bool blocked(Ray ray, vec2 cell, float face, float depth, bool enabled) {
    ivec2 fine = clamp(ivec2(cell), ivec2(0), ivec2(GLS_CELLS - 1));
    uint link = texelFetch(u_heads, fine + ivec2(0, int(face) * GLS_CELLS), 0).r;
    uint rest = texelFetch(u_heads, fine / GLS_RATIO + ivec2(0, GLS_FACES * GLS_CELLS + int(face) * (GLS_CELLS / GLS_RATIO)), 0).r;
    link = enabled ? link : 0u;
    rest = enabled ? rest : 0u;
    uint first_link = link, first_rest = rest;
    bool dark = false, doubtful = false;
    // One loop for both lists: llvmpipe skips only loops with a variable trip count, and miscompiles what an inner loop leaves behind.
    while ((link | rest) != 0u) {
        bool fine_left = link != 0u;
        uvec4 entry = texelFetch(u_links, int(fine_left ? link : rest) - 1);
        rest = fine_left ? rest : entry.y;
        link = fine_left ? entry.y : 0u;
        int triangle = int(entry.x);
        if (triangle == receiver_triangle || uintBitsToFloat(entry.z) > depth) continue;
        Facet other = facet(triangle);
#if GLS_CAPSULES
        if (is_capsule(other.normal.x)) {
            if (capsule_blocks(ray, other)) {
                dark = true;
                link = 0u;
                rest = 0u;
            }
            continue;
        }
#endif
        vec3 area = turns(across(ray, other.a), across(ray, other.b), across(ray, other.c));
        if (!met(area)) continue;
#if GLS_MASKED
        if (entry.w != 0u && !solid(int(entry.w) - 1, area)) continue;
#endif
        int side = behind(ray, other);
#if GLS_CAPSULES
        doubtful = doubtful || side < 0 && receiver_triangle >= 0 && !receiver_round;
#else
        doubtful = doubtful || side < 0 && receiver_triangle >= 0;
#endif
        if (side > 0) {
            dark = true;
            link = 0u;
            rest = 0u;
        }
    }
    // Second pass for receivers beside a fold: rare, and a separate loop costs other receivers nothing.
    link = doubtful && !dark ? first_link : 0u;
    rest = doubtful && !dark ? first_rest : 0u;
    while ((link | rest) != 0u) {
        bool fine_left = link != 0u;
        uvec4 entry = texelFetch(u_links, int(fine_left ? link : rest) - 1);
        rest = fine_left ? rest : entry.y;
        link = fine_left ? entry.y : 0u;
        int triangle = int(entry.x);
        if (triangle == receiver_triangle || entry.w != 0u) continue;
        Facet other = facet(triangle);
#if GLS_CAPSULES
        if (is_capsule(other.normal.x)) continue;
#endif
        if (!met(turns(across(ray, other.a), across(ray, other.b), across(ray, other.c)))) continue;
        if (folds_before(facet(receiver_triangle), other)) {
            dark = true;
            link = 0u;
            rest = 0u;
        }
    }
    return dark;
}

#if GLS_CAPSULES && GLS_MARKS
const uint CAPSULE_LINK = 0xffffffffu; // in place of a mask
const float MOST_CELLS = 16.0;
uniform vec4 u_capsule_cells; // outside of these fine cells there are none

// Whether the lists of the cells that a pixel's footprint covers hold a ball or tube before it: without one none darkens any of its samples.
bool capsules_in(PixelFootprint f) {
    vec3 position = f.middle, reach = abs(f.right) + abs(f.up) + abs(f.aside);
    int top = 0, coarse = GLS_FACES * GLS_CELLS;
#if GLS_POINT
    float axis = face_axis(position), s = face_side(position, axis);
    mat3 face = transpose(mat3(face_right(axis, s), face_up(axis, s), face_backward(axis, s)));
    int number = int(face_number(axis, s));
    top = number * GLS_CELLS;
    coarse += number * (GLS_CELLS / GLS_RATIO);
    position = face * position;
    reach = abs(face * f.right) + abs(face * f.up) + abs(face * f.aside);
#endif
    float depth = -position.z;
    bool open = f.open;
#if GLS_AT_INFINITY
    vec2 place = position.xy, extent = reach.xy;
#else
    open = open || !(reach.z < MOST_FORESHORTENED * depth);
    vec2 place = position.xy / depth, extent = (reach.xy + abs(place) * reach.z) / (depth - min(reach.z, MOST_FORESHORTENED * depth));
#endif
    const float cells = float(GLS_CELLS);
    vec2 cell = place * u_cells.xy + u_cells.zw, around = 1.01 * extent * u_cells.xy + 1e-3;
    vec2 low = floor(clamp(cell - around, 0.0, cells - 1.0)), high = floor(clamp(cell + around, 0.0, cells - 1.0));
#if GLS_POINT
    open = open || any(lessThan(cell, around)) || any(greaterThan(cell + around, vec2(cells)));
#elif !GLS_AT_INFINITY
    open = open || any(lessThan(min(abs(cell), abs(cell - cells)), around)); // beyond the window casters are unknown
#endif
    vec2 size = high - low + 1.0;
    open = open || !(size.x * size.y <= MOST_CELLS);
    bool inside = (depth > 0.0 || GLS_AT_INFINITY == 1) && !f.mixed;
    inside = inside && all(greaterThan(cell + around, u_capsule_cells.xy)) && all(lessThan(cell - around, u_capsule_cells.zw));
    bool found = inside && open;
    int wide = open ? 1 : int(size.x), left = inside && !open ? int(size.x * size.y) : 0;
    ivec2 first = ivec2(low);
    uint link = 0u, rest = 0u;
    while (left > 0 || (link | rest) != 0u) { // one loop, see above
        bool next = (link | rest) == 0u;
        left -= next ? 1 : 0;
        ivec2 at = first + ivec2(left % wide, left / wide);
        uint fine_head = texelFetch(u_heads, at + ivec2(0, top), 0).r, coarse_head = texelFetch(u_heads, at / GLS_RATIO + ivec2(0, coarse), 0).r;
        bool fine_left = link != 0u;
        uvec4 entry = texelFetch(u_links, max(int(fine_left ? link : rest) - 1, 0));
        bool before = !next && entry.w == CAPSULE_LINK && uintBitsToFloat(entry.z) <= depth + reach.z;
        found = found || before;
        rest = before ? 0u : next ? coarse_head : fine_left ? rest : entry.y;
        link = before ? 0u : next ? fine_head : fine_left ? entry.y : 0u;
        left = before ? 0 : left;
    }
    return found;
}
#endif
