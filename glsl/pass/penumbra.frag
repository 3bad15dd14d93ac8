// Number of an area light's sample points that each visible surface sees, in three passes. GLS_STAGE 0: for the image, or (GLS_PER_SAMPLE)
// samples of collected pixels: all or none of them where no silhouette edge cuts the light, as for the light's centre; other pixels are
// collected. 1: lists for each of those the triangles that may block it. 2: tests these against each sample point.
//
// The border of the hidden part of the light consists of silhouette edges: triangle edges where a caster ends or folds back. Other edges,
// between two triangles that face the same way, are no border. So if no silhouette edge is in the cone from a surface to the light, the
// light is wholly visible or wholly hidden. Triangles that are alpha-tested or go through the light count as silhouettes as a whole. After
// Laine, Aila, Assarsson, Lehtinen, Akenine-Moeller 2005, "Soft Shadow Volumes for Ray Tracing", SIGGRAPH, which tests edges in wedges.
#ifndef GLS_STAGE
#define GLS_STAGE 0
#endif
#ifndef GLS_ORTHO
#define GLS_ORTHO 0 // 1: an orthographic camera
#endif
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_POINT
#define GLS_POINT 0
#endif
#ifndef GLS_PER_SAMPLE
#define GLS_PER_SAMPLE 0
#endif
#ifndef GLS_SELECTIVE
#define GLS_SELECTIVE 0 // 1: some triangles receive no shadows
#endif
#ifndef GLS_MASKED
#define GLS_MASKED 0
#endif
#ifndef GLS_ROUNDED
#define GLS_ROUNDED 0 // 1: some triangles are shaded as smooth surfaces
#endif
#ifndef GLS_RECT
#define GLS_RECT 0 // 1: a rectangular area light
#endif
#ifndef GLS_POINTS
#define GLS_POINTS 0 // 1, 2: receivers are given as points, see lib/given_point.glsl; all stages then draw over these
#endif
#ifndef GLS_MARKS
#define GLS_MARKS 0 // 1, with GLS_STAGE 0: marks pixels whose samples may see the light differently, by the highest bit
#endif
#include "lib/camera_rays.glsl"
#if GLS_PER_SAMPLE
#include "lib/per_sample.glsl"
#endif
#if (GLS_PER_SAMPLE || GLS_STAGE > 0) && !GLS_POINTS
#include "lib/sample_ray.glsl"
#endif
#if GLS_POINTS
#include "lib/given_point.glsl"
#endif
#include "lib/surface_number.glsl"
#include "lib/cone.glsl"
#if GLS_MARKS
#include "lib/pixel_footprint.glsl"
#endif
#include <shadow>
#include <between>
#include "lib/surface_point.glsl"
#if GLS_ROUNDED
#include "lib/octahedral.glsl"
#include "lib/smooth_point.glsl"
#endif
#if GLS_ROUNDED || GLS_POINTS
flat in mat3 v_axes_l;
#endif
#if GLS_POINTS
flat in vec3 v_lv_from_l;
#endif
uniform usampler2D u_surface;
flat in vec3 v_forward_l;
#if GLS_STAGE > 0
uniform usamplerBuffer u_fragments; // x | y << 16
uniform ivec3 u_partly_lit; // first pixel of the batch, number of pixels, pixels in a row
#endif
#if GLS_STAGE == 1
layout(location = 0) out uint o_list;
#elif GLS_STAGE == 2
#ifndef GLS_SIDE
#define GLS_SIDE 2 // fragments along a side of a pixel's block: they share the sample points
#endif
uniform usampler2D u_lists;
layout(r32ui, binding = 0) uniform uimage2D u_counts;
#else
layout(early_fragment_tests) in;
layout(std430, binding = 0) buffer PartlyLit { uint partly_lit_count; };
layout(std430, binding = 1) writeonly buffer Fragments { uint fragments[]; };
uniform int u_count; // sample points of the light
#if GLS_RECT
uniform mat3 u_rect; // see exact/found.glsl
#endif
layout(location = 0) out uint o_seen;
#endif

#if GLS_STAGE == 0 || GLS_ROUNDED
vec2 heights(vec3 position, vec3 normal) { // of the light's lowest and highest point above the receiver's horizon
#if GLS_AT_INFINITY
    float middle = normal.z, reach = u_radius * length(normal.xy);
#else
    float near = inversesqrt(dot(position, position));
    float middle = -dot(normal, position), reach = u_radius * sqrt(max(1.0 - middle * middle * near * near, 0.0));
#endif
    return vec2(middle - reach, middle + reach);
}
#endif

void main() {
#if GLS_STAGE > 0
    ivec2 block = ivec2(gl_FragCoord.xy);
#if GLS_STAGE == 2
    ivec2 within = block % GLS_SIDE;
    block /= GLS_SIDE;
#endif
    int number = block.y * u_partly_lit.z + block.x;
    bool beyond = number >= u_partly_lit.y; // past the end
    uint bits = texelFetch(u_fragments, u_partly_lit.x + min(number, u_partly_lit.y - 1)).r;
    ivec2 fragment = ivec2(int(bits & 0xffffu), int(bits >> 16u));
#else
    ivec2 fragment = ivec2(gl_FragCoord.xy);
#endif
#if GLS_PER_SAMPLE
    ivec2 texel = sample_texel(fragment);
#else
    ivec2 texel = fragment;
#endif
#if GLS_POINTS
    GivenPoint given = given_point(texel, v_axes_l);
#elif GLS_PER_SAMPLE || GLS_STAGE > 0
    vec3 eye, ray;
    sample_ray(texel, v_forward_l, eye, ray);
#else
    vec3 eye = v_eye_l, ray = v_ray_l;
#endif
    uvec4 surface = texelFetch(u_surface, texel, 0);
    int triangle = triangle_of(surface.r);
    bool seen = triangle >= 0; // else background
    triangle = max(triangle, 0);
    Facet own = facet(triangle);
#if GLS_POINTS
    bool on_surface = seen;
    seen = true;
    vec3 position = given.position + v_lv_from_l;
    position = on_surface ? onto_plane(triangle, own, position) : position;
    float side = on_surface ? given_side(given, own.normal) : 1.0;
    vec3 normal = side * own.normal;
    if (!on_surface) {
        receiver_free = given.normal == vec3(0.0);
#if GLS_AT_INFINITY
        vec3 towards = vec3(0.0, 0.0, 1.0);
#else
        vec3 towards = -position * inversesqrt(max(dot(position, position), 1e-36));
#endif
        normal = receiver_free ? towards : normalize(given.normal);
    }
    receiver_triangle = on_surface ? triangle : -1;
    receiver_corner = on_surface ? plane_corner(own) : position;
#else
    vec3 position = surface_point(triangle, own, eye, ray, v_forward_l);
    float side = dot(own.normal, ray) > 0.0 ? -1.0 : 1.0; // the visible side
    vec3 normal = side * own.normal;
    receiver_triangle = triangle;
    receiver_corner = plane_corner(own);
#endif
    receiver_face = normal;
#if GLS_ROUNDED
#if GLS_AT_INFINITY
    float lowest = heights(position, normal).x;
#else
    float lowest = heights(position, normal).x * inversesqrt(dot(position, position));
#endif
    mat3 corners = mat3(own.a, own.b, own.c);
    SmoothPoint rounded = smooth_point(triangle, position, normal, side, lowest, corners, v_axes_l, 2.0 * receiver_bound(position));
#if GLS_POINTS
    if (!on_surface) rounded = SmoothPoint(position, normal, false, false);
#endif
    position = rounded.position;
    normal = rounded.normal;
    if (rounded.lifted) {
        receiver_triangle = -1;
        receiver_face = normal;
    }
#endif
#if GLS_SELECTIVE
    bool darkened = is_darkened(surface.r);
#else
    const bool darkened = true;
#endif
#if GLS_STAGE == 1
    o_list = beyond || !darkened ? 0u : gather(position, normal);
#elif GLS_STAGE == 2
    uint list = texelFetch(u_lists, block, 0).r;
    int count = beyond ? 0 : seen_points(position, normal, list, within.x + GLS_SIDE * within.y, GLS_SIDE * GLS_SIDE, texel);
    for (int i = 0; i < min(count, 1); i++) imageAtomicAdd(u_counts, fragment, uint(count));
#else
    vec2 height = heights(position, normal);
#if GLS_ROUNDED
    height = min(height, heights(position, receiver_face));
#endif
#if GLS_RECT
    seen = seen && dot(position, u_rect[2]) > 0.0; // dark behind the light
#endif
    bool above = height.x > 0.0, below = height.y <= 0.0 || !seen; // the whole light is above or below the receiver's horizon
    bool cut = !above && !below;
    if (above && darkened) cut = is_cut(position);
    float lit = above && darkened && !cut ? light_visibility(position, normal, 1.0) : 1.0;
    o_seen = below || cut ? 0u : uint(lit) * uint(u_count);
#if GLS_MARKS
    PixelFootprint sampled = pixel_footprint(position, normal, eye, ray);
    o_seen |= darkened && seen && samples_differ(sampled, 0.5 * (height.x + height.y), lit) ? 0x80000000u : 0u;
#endif
    int wanted = cut ? 1 : 0;
    for (int i = 0; i < wanted; i++) { // not an if: llvmpipe would execute the atomics for every pixel
        fragments[atomicAdd(partly_lit_count, 1u)] = uint(fragment.x) | uint(fragment.y) << 16u;
    }
#endif
}
