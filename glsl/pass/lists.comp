// Triangle lists of one light, one invocation per triangle: writes its facet, and a link to it into the list of every cell that it
// may touch.
#ifndef GLS_SUN
#define GLS_SUN 0
#endif
#ifndef GLS_POINT
#define GLS_POINT 0
#endif
#ifndef GLS_CELLS
#define GLS_CELLS 512 // along a side of the fine grid
#endif
#ifndef GLS_AREA
#define GLS_AREA 0 // 1: the light has a size
#endif
#include "lib/cells.glsl"
#include "lib/placed.glsl"
#include "lib/traits.glsl"
layout(local_size_x = 64) in;
// read as texture buffers: llvmpipe (Mesa 22.3) takes three times as long for storage buffers
uniform samplerBuffer u_positions; // world axes, relative to the scene's origin
layout(std430, binding = 0) writeonly buffer Facets { vec4 facets[]; };
uniform mat3 u_axes; // the light's, from world axes
uniform vec3 u_origin; // of the light's frame, relative to the scene's origin

vec3 vertex(uint i) {
    return texelFetch(u_positions, int(i)).xyz;
}

void main() {
    uint triangle = invocation();
    if (triangle >= uint(u_triangles)) return;
    uvec4 corners = texelFetch(u_corners, int(triangle));
    vec3 a = vertex(corners.x), b = vertex(corners.y), c = vertex(corners.z);
    vec3 normal = unit_normal(a, b, c, u_axes);
    a = placed(a, u_origin, u_axes);
    b = placed(b, u_origin, u_axes);
    c = placed(c, u_origin, u_axes);
    facets[3u * triangle] = vec4(a, normal.x);
    facets[3u * triangle + 1u] = vec4(b, normal.y);
    facets[3u * triangle + 2u] = vec4(c, normal.z);
    uvec2 node = texelFetch(u_traits, int(corners.w)).xy;
    uint flags = node.x;
    uint mask = (flags & CUT_OUT) != 0u ? triangle + node.y : 0u;
#if GLS_SUN
    float side = normal.z; // > 0: its front is turned to the light
    float unit = length(normal.xy);
#else
    float side = -dot(normal, a) / max(length(a), 1e-30);
    float unit = 1.0 / max(length(a), 1e-30);
#endif
    float edge_on = 1e-5; // is kept: rounding decides its side
#if GLS_AREA
    edge_on += u_radius * unit; // as is what only a part of the light sees from the front
#endif
    bool away = (flags & CULL_BACK) != 0u && side < -edge_on || (flags & CULL_FRONT) != 0u && side > edge_on;
    bool casts = normal != vec3(0.0) && !away && (flags & CASTS) != 0u;
    if (GLS_AREA == 0 && !casts) return;
    for (int face = 0; face < FACES; face++) {
        mat3 turned = face_from_lv(face);
        vec3 p = turned * a, q = turned * b, r = turned * c;
        if (!near_window(p, q, r, 0.0)) continue;
        Footprint shape = footprint(p, q, r);
#if GLS_AREA
        deepen(face, shape);
#endif
        if (casts) insert(triangle, mask, face, shape);
    }
}
