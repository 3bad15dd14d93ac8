// A capsule where a pixel's ray enters it: for the camera its number and colour, as pass/surface.frag writes them, for a light's map its depth
// or metric, as pass/caster.frag does.
#ifndef GLS_CAPSULES
#define GLS_CAPSULES 1 // 2: also tubes
#endif
#ifndef GLS_ORTHO
#define GLS_ORTHO 0 // 1: an orthographic view
#endif
#ifndef GLS_CASTS
#define GLS_CASTS 0 // 1: draws a light's map
#endif
#ifndef GLS_METRIC
#define GLS_METRIC 0
#endif
#ifndef GLS_PACKED
#define GLS_PACKED 0
#endif
#ifndef GLS_SURFACE
#define GLS_SURFACE 1 // channels of the surface buffer, see pass/surface.frag
#endif
#ifndef GLS_COLORED
#define GLS_COLORED 0 // 1: colours of vertices
#endif
#ifndef GLS_EMITS
#define GLS_EMITS 0 // 1: the surface buffer has emission
#endif
#include "lib/capsule.glsl"
uniform vec4 u_window; // half width and height, middle
uniform vec2 u_half_size; // of the image or tile, in pixels
uniform vec2 u_corner; // of the tile, in pixels
uniform vec2 u_depths; // window depth = x + y / depth; GLS_ORTHO: x + y * depth
uniform float u_near; // nearer surfaces are not seen
flat in vec3 v_a;
flat in float v_radius;
#if GLS_CAPSULES == 2
flat in vec3 v_b;
#endif
#if GLS_EMITS
layout(location = 1) out uint o_emission;
#endif
#if GLS_CASTS
#if GLS_METRIC
#include <metric>
#include "lib/packing.glsl"
uniform mat4 u_clip_from_view; // depth_metric's first argument
layout(location = 0) out vec4 o_stored;
#endif
#else
flat in uint v_number;
flat in uvec2 v_ends;
#if GLS_SURFACE == 1
layout(location = 0) out uint o_surface;
#elif GLS_SURFACE == 2
layout(location = 0) out uvec2 o_surface;
#else
#include "lib/color_packing.glsl"
layout(location = 0) out uvec4 o_surface;
uniform vec4 u_color; // linear factor
#if GLS_COLORED
uniform samplerBuffer u_vertex_colors; // linear
uniform uint u_first_vertex; // of the node
#endif
#endif
#endif

void main() {
    vec2 place = ((gl_FragCoord.xy - u_corner) / u_half_size - 1.0) * u_window.xy + u_window.zw;
#if GLS_ORTHO
    vec3 eye = vec3(place, 0.0), ray = vec3(0.0, 0.0, 1.0);
#else
    vec3 eye = vec3(0.0), ray = vec3(place, 1.0);
#endif
#if GLS_CAPSULES == 2
    CapsuleHit hit = capsule_hit(Capsule(v_a, v_b, v_radius), eye, ray);
#else
    CapsuleHit hit = capsule_hit(Capsule(v_a, v_a, v_radius), eye, ray);
#endif
    if (!hit.met || hit.along < u_near) discard;
#if GLS_ORTHO
    gl_FragDepth = u_depths.x + u_depths.y * hit.along;
#else
    gl_FragDepth = u_depths.x + u_depths.y / hit.along;
#endif
#if GLS_CASTS
#if GLS_METRIC
    vec3 position = (eye + ray * hit.along) * vec3(1.0, 1.0, -1.0);
    float metric = depth_metric(u_clip_from_view * vec4(position, 1.0), position);
#if GLS_PACKED
    o_stored = pack(min(metric, 0.99999994));
#else
    o_stored = vec4(metric, 0.0, 0.0, 1.0);
#endif
#endif
#elif GLS_SURFACE == 1
    o_surface = v_number;
#elif GLS_SURFACE == 2
    o_surface = uvec2(v_number, 0u);
#else
    vec3 color = u_color.rgb;
#if GLS_COLORED
    vec3 first = texelFetch(u_vertex_colors, int(v_ends.x - u_first_vertex)).rgb;
    color *= mix(first, texelFetch(u_vertex_colors, int(v_ends.y - u_first_vertex)).rgb, hit.share);
#endif
    o_surface = uvec4(v_number, 0u, pack_color(color), 0xff00ffffu); // matte, see lib/material_packing.glsl
#endif
#if GLS_EMITS
    o_emission = 0u;
#endif
}
