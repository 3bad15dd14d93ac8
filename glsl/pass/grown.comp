// The casters of an area light, into grids of grown items, one invocation per triangle. GLS_SILHOUETTES 0: triangles. 1: what may separate
// visible from hidden parts of the light: edges that are silhouettes for some part of the light, where a caster ends or folds back; and
// whole triangles that are alpha-tested or go through the light. Between two triangles on the same side of the whole light the visibility
// does not change. Needs the facets and the grounds of pass/lists.comp.
#ifndef GLS_AREA
#define GLS_AREA 1
#endif
#ifndef GLS_PLACES_GROWN
#define GLS_PLACES_GROWN 1
#endif
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_POINT
#define GLS_POINT 0
#endif
#ifndef GLS_SILHOUETTES
#define GLS_SILHOUETTES 0
#endif
#include "lib/cells.glsl"
#include "lib/facet.glsl"
#include "lib/traits.glsl"
layout(local_size_x = 64) in;
uniform usamplerBuffer u_neighbours; // per triangle: across its edges ab, bc, ca; see glshadow.geometry.adjacency
const uint NONE = 0xffffffffu, TURNED = 0x80000000u;
const uint WHOLE = 3u; // in place of an edge's number
const float SLACK = 1e-5; // sine below which rounding decides the side

bool casts(Facet one, uint flags) {
    return (flags & CASTS) != 0u && one.normal != vec3(0.0);
}

int side(vec3 normal, vec3 a) { // 1: the whole light is in front, -1: behind, 0: on both sides of the plane
#if GLS_AT_INFINITY
    float middle = normal.z, reach = u_radius * length(normal.xy) + SLACK;
#else
    float middle = -dot(normal, a), reach = u_radius + SLACK * length(a);
#endif
    return abs(middle) <= reach ? 0 : middle > 0.0 ? 1 : -1;
}

void insert_in_faces(uint item, uint rest, vec3 a, vec3 b, vec3 c) {
    for (int face = 0; face < FACES; face++) {
        mat3 turned = face_from_lv(face);
        vec3 p = turned * a, q = turned * b, r = turned * c;
        if (near_window(p, q, r, u_radius)) insert_grown(item, rest, face, footprint(p, q, r), GLS_SILHOUETTES == 1 && rest < WHOLE);
    }
}

void main() {
    uint triangle = own_triangle();
    if (triangle >= u_part.y) return;
    Facet own = facet(int(triangle));
    uvec2 node = traits_of(triangle);
    uint flags = node.x;
    if (!casts(own, flags)) return;
    int own_side = side(own.normal, own.a);
#if !GLS_SILHOUETTES
    if (own_side < 0 && (flags & CULL_BACK) != 0u) return;
    uint mask = (flags & CUT_OUT) != 0u ? triangle + node.y : 0u;
    insert_in_faces(triangle, mask, own.a, own.b, own.c);
#else
    bool whole = (flags & CUT_OUT) != 0u;
#if !GLS_AT_INFINITY
    // a triangle through the light cuts it inside its own edges
    vec3 middle = (own.a + own.b + own.c) / 3.0;
    float around = max(distance(middle, own.a), max(distance(middle, own.b), distance(middle, own.c)));
    whole = whole || abs(dot(own.normal, own.a)) <= 1.001 * u_radius && length(middle) - around <= 1.001 * u_radius;
#endif
    if (whole) {
        insert_in_faces(triangle, WHOLE, own.a, own.b, own.c);
        return;
    }
    uvec3 neighbours = texelFetch(u_neighbours, int(triangle)).xyz;
    for (int i = 0; i < 3; i++) {
        uint neighbour = neighbours[i];
        bool silhouette = true;
        if (neighbour != NONE) {
            uint number = neighbour & ~TURNED;
            Facet other = facet(int(number));
            uint others = traits_of(number).x;
            if (casts(other, others) && (others & CUT_OUT) == 0u) {
                int other_side = side(other.normal, other.a) * ((neighbour & TURNED) != 0u ? -1 : 1);
                silhouette = triangle < number && (own_side == 0 || own_side != other_side);
            }
        }
        if (!silhouette) continue;
        vec3 a = i == 0 ? own.a : i == 1 ? own.b : own.c, b = i == 0 ? own.b : i == 1 ? own.c : own.a;
        insert_in_faces(triangle, uint(i), a, b, b);
    }
#endif
}
