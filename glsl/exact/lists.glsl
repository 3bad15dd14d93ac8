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
