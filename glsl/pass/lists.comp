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
uniform mat3 u_axes; // the light's, from world axes
uniform vec3 u_origin; // of the light's frame, relative to the scene's origin
uniform int u_triangles;

vec3 vertex(uint i) { // in double, so that the light's frame adds one rounding, and the same to every copy of a vertex
    dvec3 p = dvec3(texelFetch(u_positions, int(i)).xyz) - dvec3(u_origin);
    return vec3(dmat3(u_axes) * p);
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
    float unit = length(normal.xy);
#else
    float side = -dot(normal, a) / max(length(a), 1e-30);
    float unit = 1.0 / max(length(a), 1e-30);
#endif
    float edge_on = 1e-5; // is kept: rounding decides its side
#if GLS_AREA
    edge_on += u_radius * unit; // as is what only a part of the light sees from the front
#endif
    bool away = (flags & GLS_CULL_BACK) != 0u && side < -edge_on || (flags & GLS_CULL_FRONT) != 0u && side > edge_on;
    bool casts = size > 0.0 && !away && (flags & GLS_CASTS) != 0u;
    if (GLS_AREA == 0 && !casts) return;
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
#else
        const bool seen = true;
#endif
#if GLS_AREA
        Footprint shape = footprint(p, q, r);
        if (seen) deepen(face, shape);
        if (casts && seen) insert(triangle, mask, face, shape);
#else
        if (seen) insert(triangle, mask, face, footprint(p, q, r));
#endif
#if GLS_POINT
    }
#endif
}
