// Slot <between>: lists the triangles that may lie between a receiver and any point of an area light. Needs
// lib/cone.glsl.
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_HUGE
#define GLS_HUGE 0
#endif
#ifndef GLS_POINTS
#define GLS_POINTS 0
#endif
#include "exact/grown.glsl"
uniform uint u_capacity;
layout(std430, binding = 0) buffer Counter { uint found_count; };
layout(std430, binding = 1) writeonly buffer Found { uvec4 found[]; }; // triangle, next link + 1, mask + 1
const uint ALL_HIDDEN = 0xffffffffu;
const float CAREFUL = 1.001; // factor on compared values: exceeds any rounding

uint gather(vec3 position, vec3 normal) { // first link + 1; 0: empty
    float bound = receiver_bound(position);
#if !GLS_AT_INFINITY
    mat3 axes = cone_axes(position);
#endif
    Place place = place_of(position);
    uint list = 0u, link = head_at(place);
    while (link != 0u) {
        uvec4 entry = texelFetch(u_grown_links, int(link) - 1);
        link = entry.y;
        int triangle = int(entry.x);
        if (triangle == receiver_triangle || uintBitsToFloat(entry.z) > place.depth) continue;
        Facet other = facet(triangle);
        vec3 offset = position - other.a;
        float gap = dot(other.normal, offset);
#if GLS_AT_INFINITY
        float side = -other.normal.z, reach = u_radius * length(other.normal.xy);
#else
        float side = dot(other.normal, other.a), reach = u_radius + u_bound.x;
#endif
        bool one_side = abs(side) > CAREFUL * reach;
        float behind_by = (side < 0.0 ? -gap : gap) - bound - u_bound.y * dot(abs(offset), vec3(1.0));
        vec3 a = other.a - position, b = other.b - position, c = other.c - position;
        float height = max(dot(normal, a), max(dot(normal, b), dot(normal, c)));
#if GLS_POINTS
        height = receiver_free ? 1.0 : height;
#endif
        vec3 ab = TO_CONE(axes, other.b - other.a), bc = TO_CONE(axes, other.c - other.b), ca = TO_CONE(axes, other.a - other.c);
        a = TO_CONE(axes, a);
        b = TO_CONE(axes, b);
        c = TO_CONE(axes, c);
        vec3 p = cross(a, ab), q = cross(b, bc), r = cross(c, ca); // normals of the planes through the receiver and an edge
        float turn = dot(p, c) < 0.0 ? -1.0 : 1.0;
        vec3 inside = turn * vec3(p.z, q.z, r.z), wide_by = u_radius * vec3(length(p.xy), length(q.xy), length(r.xy));
        bool meets = all(greaterThanEqual(inside, -CAREFUL * wide_by)) && height > 0.0 && (!one_side || behind_by > 0.0);
#if !GLS_HUGE
        if (meets && one_side && entry.w == 0u && all(greaterThan(inside, CAREFUL * wide_by))) {
            list = ALL_HIDDEN; // this triangle hides all of the light
            link = 0u;
            meets = false;
        }
#endif
        if (meets && list != ALL_HIDDEN) {
            uint at = atomicAdd(found_count, 1u);
            if (at < u_capacity) {
                found[at] = uvec4(entry.x, list, entry.w, 0u);
                list = at + 1u;
            }
        }
    }
    return list;
}
