// Lists the silhouette edges of a light's casters, one invocation per triangle: edges where a caster ends, or where its surface folds back
// for some part of the light. An alpha-tested triangle is listed as a whole: its silhouette may be anywhere inside. Needs the facets of
// pass/lists.comp.
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#include "lib/facet.glsl"
#include "lib/traits.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) writeonly buffer Edges { uint edges[]; }; // 4 * triangle + 0 to 2: edge ab, bc, ca; + 3: the whole triangle
layout(std430, binding = 1) buffer Counter { uint edge_count; }; // keeps counting when the buffer is full
uniform usamplerBuffer u_neighbours; // per triangle: across its edges ab, bc, ca; see glshadow.geometry.adjacency
uniform uint u_capacity;
uniform float u_radius; // radius of the light: a tangent (directional light), or world units; 0: a point
const uint NONE = 0xffffffffu, TURNED = 0x80000000u, WHOLE = 3u;
const float SLACK = 1e-5; // sine below which rounding decides the side

int side(vec3 normal, vec3 a) { // 1: the whole light is in front, -1: behind, 0: on both sides of the plane
#if GLS_AT_INFINITY
    float middle = normal.z, reach = u_radius * length(normal.xy) + SLACK;
#else
    float middle = -dot(normal, a), reach = u_radius + SLACK * length(a);
#endif
    return abs(middle) <= reach ? 0 : middle > 0.0 ? 1 : -1;
}

bool casts(Facet one, int seen, uint flags) {
    bool away = (flags & CULL_BACK) != 0u && seen < 0 || (flags & CULL_FRONT) != 0u && seen > 0;
    return (flags & CASTS) != 0u && one.normal != vec3(0.0) && !away;
}

void add(uint edge) {
    uint at = atomicAdd(edge_count, 1u);
    if (at < u_capacity) edges[at] = edge;
}

void main() {
    uint triangle = own_triangle();
    if (triangle >= u_part.y) return;
    Facet own = facet(int(triangle));
    uint flags = traits_of(triangle).x;
    if ((flags & ROUND) != 0u) return;
    int seen = side(own.normal, own.a);
    if (!casts(own, seen, flags)) return;
    if ((flags & CUT_OUT) != 0u) {
        add(4u * triangle + WHOLE);
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
            int other_seen = side(other.normal, other.a);
            if (casts(other, other_seen, others) && (others & CUT_OUT) == 0u) { // the first of the two triangles lists the edge
                other_seen *= (neighbour & TURNED) != 0u ? -1 : 1;
                silhouette = triangle < number && (seen == 0 || seen != other_seen);
            }
        }
        if (silhouette) add(4u * triangle + uint(i));
    }
}
