// Triangle lists of one light, one invocation per triangle: writes its facet, and links it into the list of every cell that it may
// overlap.
#ifndef GLS_CAPSULES
#define GLS_CAPSULES 0 // 1: the scene has balls; 2: also tubes
#endif
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_POINT
#define GLS_POINT 0
#endif
#ifndef GLS_CELLS
#define GLS_CELLS 512 // along a side of the fine grid
#endif
#ifndef GLS_AREA
#define GLS_AREA 0 // 1: area light
#endif
#ifndef GLS_ROUNDED
#define GLS_ROUNDED 0 // 1: some triangles are shaded as smooth surfaces, whose points lie above them
#endif
#include "lib/cells.glsl"
#if GLS_CAPSULES
#include "lib/capsule.glsl"
#include "lib/capsule_cells.glsl"
#endif
#include "lib/placed.glsl"
#include "lib/traits.glsl"
layout(local_size_x = 64) in;
// read as texture buffers: llvmpipe (Mesa 22.3) takes three times as long for storage buffers
uniform samplerBuffer u_positions; // world axes, relative to the scene's origin
layout(std430, binding = 0) writeonly buffer Facets { vec4 facets[]; }; // of the part's triangles, see lib/facet.glsl
uniform mat3 u_axes; // the light's, from world axes
uniform vec3 u_origin; // of the light's frame, relative to the scene's origin

vec3 vertex(uint i) {
    return texelFetch(u_positions, int(i)).xyz;
}

#if GLS_AREA && GLS_ROUNDED
#include "lib/octahedral.glsl"
uniform usamplerBuffer u_smooth; // see lib/smooth_point.glsl

// Largest distance of the smooth surface above it, seen from either side: 0 where the whole light is well above its horizon.
float most_lift(uint triangle, vec3 normal, vec3 a, vec3 b, vec3 c) {
#if GLS_AT_INFINITY
    float height = normal.z, reach = u_radius * length(normal.xy), far = 1.0;
#else
    float height = -dot(normal, a), reach = u_radius, far = max(length(a), max(length(b), length(c)));
#endif
    vec2 heights = vec2(height, -height);
    bvec2 low = lessThan(heights - reach, vec2(0.11 * far));
    uvec4 bits = texelFetch(u_smooth, int(triangle));
    vec3 p = u_axes * unpack_octahedral(bits.x), q = u_axes * unpack_octahedral(bits.y), r = u_axes * unpack_octahedral(bits.z);
    vec3 start = vec3(dot(a - b, p), dot(b - c, q), dot(c - a, r)), end = vec3(dot(b - a, q), dot(c - b, r), dot(a - c, p));
    if ((bits.w & 2u) != 0u) {
        start = -start;
        end = -end;
    }
    vec3 over = max(start, end), under = max(-start, -end);
    float most = max(low.x ? max(over.x, max(over.y, over.z)) : 0.0, low.y ? max(under.x, max(under.y, under.z)) : 0.0);
    return 0.6667 * max(most, 0.0) * float(bits.w >> 16u) / 65535.0; // 0: flat; see glshadow.geometry.smooth.heights
}
#endif

void main() {
    uint triangle = own_triangle();
    if (triangle >= u_part.y) return;
    uvec4 corners = texelFetch(u_corners, int(triangle));
    vec3 a = vertex(corners.x), b = vertex(corners.y), c = vertex(corners.z);
    uint place = 3u * (triangle - u_part.x);
    uvec2 node = texelFetch(u_traits, int(corners.w)).xy;
    uint flags = node.x;
#if GLS_CAPSULES
    if ((flags & ROUND) != 0u) {
        a = placed(a, u_origin, u_axes);
        b = placed(b, u_origin, u_axes);
        facets[place] = vec4(a, CAPSULE);
        facets[place + 1u] = vec4(b, 0.0);
        facets[place + 2u] = vec4(c.x, vec3(0.0));
        if ((flags & CASTS) != 0u) insert_capsule(triangle, Capsule(a, b, c.x));
        return;
    }
#endif
    vec3 normal = unit_normal(a, b, c, u_axes);
    a = placed(a, u_origin, u_axes);
    b = placed(b, u_origin, u_axes);
    c = placed(c, u_origin, u_axes);
    facets[place] = vec4(a, normal.x);
    facets[place + 1u] = vec4(b, normal.y);
    facets[place + 2u] = vec4(c, normal.z);
    uint mask = (flags & CUT_OUT) != 0u ? triangle + node.y : 0u;
#if GLS_AT_INFINITY
    float side = normal.z; // > 0: its front faces the light
    float unit = length(normal.xy);
#else
    float side = -dot(normal, a) / max(length(a), 1e-30);
    float unit = 1.0 / max(length(a), 1e-30);
#endif
    float edge_on = 1e-5; // kept, since rounding decides its side
#if GLS_AREA
    edge_on += u_radius * unit; // also kept if only a part of the light sees its front
#endif
    bool away = (flags & CULL_BACK) != 0u && side < -edge_on || (flags & CULL_FRONT) != 0u && side > edge_on;
    bool casts = normal != vec3(0.0) && !away && (flags & CASTS) != 0u;
    if (GLS_AREA == 0 && !casts) return;
#if GLS_AREA && GLS_ROUNDED
    float lift = 1.001 * most_lift(triangle, normal, a, b, c);
#else
    const float lift = 0.0;
#endif
    for (int face = 0; face < FACES; face++) {
        mat3 turned = face_from_lv(face);
        vec3 p = turned * a, q = turned * b, r = turned * c;
        if (!near_window(p, q, r, lift)) continue;
        Footprint shape = footprint(p, q, r);
#if GLS_AREA
        deepen(face, shape, lift);
#endif
        if (casts) insert(triangle, mask, face, shape);
    }
}
