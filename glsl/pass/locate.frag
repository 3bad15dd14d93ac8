// The triangle on which each given point lies: of those within a bound of it, in its plane and across its edges, the one that faces along
// the point's normal best, then the nearest, then the first. The bound covers the rounding of both, see receiver/exact.glsl.
#ifndef GLS_POINTS
#define GLS_POINTS 1 // 2: with normals, see lib/given_point.glsl
#endif
#ifndef GLS_CELLS
#define GLS_CELLS 512
#endif
#ifndef GLS_RATIO
#define GLS_RATIO 16
#endif
#ifndef GLS_CAPSULES
#define GLS_CAPSULES 0
#endif
#include "lib/given_point.glsl"
#include "lib/facet.glsl"
#if GLS_CAPSULES
#include "lib/capsule.glsl"
#endif
uniform usampler2D u_heads;
uniform usamplerBuffer u_links;
uniform vec4 u_cells; // cell = xy * u_cells.xy + u_cells.zw
uniform vec2 u_bound; // world units; share of the distances to the planes' corners
uniform vec2 u_huge; // largest coordinate that u_bound covers; growth with the excess over it
flat in mat3 v_axes_l;
flat in vec3 v_lv_from_l;
layout(location = 0) out uint o_triangle; // its number from 1; 0: none

float largest(vec3 v) {
    return max(abs(v.x), max(abs(v.y), abs(v.z)));
}

float across(vec3 from, vec3 to, vec3 position, vec3 normal) { // distance from an edge, outwards
    vec3 along = to - from;
    return -dot(cross(along, position - from), normal) * inversesqrt(max(dot(along, along), 1e-36));
}

void main() {
    GivenPoint given = given_point(ivec2(gl_FragCoord.xy), v_axes_l);
    vec3 position = given.position + v_lv_from_l;
    vec2 cell = position.xy * u_cells.xy + u_cells.zw;
    bool inside = all(greaterThanEqual(cell, vec2(0.0))) && all(lessThan(cell, vec2(GLS_CELLS)));
    ivec2 fine = clamp(ivec2(cell), ivec2(0), ivec2(GLS_CELLS - 1));
    uint link = inside ? texelFetch(u_heads, fine, 0).r : 0u;
    uint rest = inside ? texelFetch(u_heads, fine / GLS_RATIO + ivec2(0, GLS_CELLS), 0).r : 0u;
    int found = -1;
    float best = -1.0, nearest = 0.0;
    while ((link | rest) != 0u) { // one loop for both lists, see exact/lists.glsl
        bool fine_left = link != 0u;
        uvec4 entry = texelFetch(u_links, int(fine_left ? link : rest) - 1);
        rest = fine_left ? rest : entry.y;
        link = fine_left ? entry.y : 0u;
        int triangle = int(entry.x);
        Facet other = facet(triangle);
#if GLS_CAPSULES
        if (is_capsule(other.normal.x)) continue;
#endif
        vec3 offset = position - other.a;
        float bound = 2.0 * (u_bound.x + 3.0 * u_bound.y * dot(abs(offset), vec3(1.0)));
        float reach = max(largest(position), max(largest(other.a), max(largest(other.b), largest(other.c))));
        bound += 2.0 * u_huge.y * max(reach - u_huge.x, 0.0);
        vec3 beside = vec3(across(other.a, other.b, position, other.normal), across(other.b, other.c, position, other.normal),
                           across(other.c, other.a, position, other.normal));
        float away = max(abs(dot(other.normal, offset)), max(beside.x, max(beside.y, beside.z)));
        if (!(away <= bound) || other.normal == vec3(0.0)) continue;
#if GLS_POINTS == 2
        float facing = abs(dot(given.normal, other.normal)) * inversesqrt(max(dot(given.normal, given.normal), 1e-36));
#else
        const float facing = 0.0;
#endif
        bool nearer = away < nearest || away == nearest && triangle < found;
        if (facing > best || facing == best && nearer) {
            found = triangle;
            best = facing;
            nearest = away;
        }
    }
    o_triangle = uint(found + 1);
}
