// One light on every visible surface: position from depth, normal from the triangle, visibility from <shadow>, Lambert shading.
// GLS_FIRST: adds the ambient term, else what earlier lights left. GLS_LAST: writes the display image, else the sum so far.
#ifndef GLS_SURFACE
#define GLS_SURFACE 1
#endif
#ifndef GLS_COLORS
#define GLS_COLORS 0 // base colour: 0 one for all, 1 per node, 2 per pixel (textures; needs 4 channels)
#endif
#ifndef GLS_FIRST
#define GLS_FIRST 1
#endif
#ifndef GLS_LAST
#define GLS_LAST 1
#endif
#ifndef GLS_LIT
#define GLS_LIT 1 // 0: no light at all, only the ambient term
#endif
#ifndef GLS_VISIBILITY
#define GLS_VISIBILITY 1 // also writes the light's visibility
#endif
#ifndef GLS_SUM
#define GLS_SUM 0 // also writes the linear sum
#endif
#include "lib/octahedral.glsl"
#include "lib/color_packing.glsl"
#include "lib/srgb.glsl"
#include <light>
#include <shadow>

uniform usampler2D u_surface;
uniform sampler2D u_camera_depth;
uniform samplerBuffer u_planes; // per drawn triangle: unit world normal, distance from the scene's origin
#if GLS_COLORS == 1
uniform usamplerBuffer u_owners; // per drawn triangle: its node
uniform samplerBuffer u_colors; // per node: base colour, linear
#elif GLS_COLORS == 0
uniform vec3 u_color; // every node's
#endif
uniform sampler2D u_sum; // linear light of earlier passes
uniform vec2 u_unproject; // 1 / view depth = x + y * window depth
uniform mat3 u_ray_w; // world ray of unit view depth = u_ray_w * (gl_FragCoord.xy, 1)
uniform vec3 u_eye_o; // the eye, relative to the scene's origin; world axes
uniform mat4 u_lv_from_o;
uniform vec3 u_radiance; // color * intensity
uniform vec3 u_ambient;
uniform float u_strength;

layout(location = 0) out vec4 o_color;
#if GLS_VISIBILITY
layout(location = 1) out float o_visibility;
#endif
#if GLS_SUM
layout(location = 2) out vec4 o_linear;
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
#if GLS_SURFACE == 1
    uint id = texelFetch(u_surface, pixel, 0).r;
    uint packed_normal = 0u;
#else
    uvec4 surface = texelFetch(u_surface, pixel, 0);
    uint id = surface.r;
    uint packed_normal = surface.g;
#endif
#if GLS_COLORS == 2
    vec3 color = unpack_color(surface.b);
#elif GLS_COLORS == 1
    vec3 color = texelFetch(u_colors, int(texelFetch(u_owners, int(id) - 1).r)).rgb;
#else
    vec3 color = u_color;
#endif
#if GLS_FIRST
    vec3 sum = u_ambient * color;
#else
    vec3 sum = texelFetch(u_sum, pixel, 0).rgb;
#endif
#if GLS_LIT
    vec4 plane = texelFetch(u_planes, int(id) - 1);
    vec3 ray = u_ray_w * vec3(gl_FragCoord.xy, 1.0);
    vec3 position_o = u_eye_o + ray / (u_unproject.x + u_unproject.y * texelFetch(u_camera_depth, pixel, 0).r);
    // Depth was interpolated between vertices snapped to 1/256 pixel: back on the plane, without leaving the triangle's
    // depth range as ray x plane would where the ray misses the triangle by a hair.
    position_o -= plane.xyz * (dot(plane.xyz, position_o) - plane.w);
    vec3 position = (u_lv_from_o * vec4(position_o, 1.0)).xyz;
    vec3 normal = mat3(u_lv_from_o) * (dot(plane.xyz, ray) > 0.0 ? -plane.xyz : plane.xyz); // the side that is seen
    vec4 arriving = light_arriving(position);
    float cosine = dot(normal, arriving.xyz);
    float lit = cosine > 0.0 ? light_visibility(position, normal, cosine) : 0.0;
#if GLS_SURFACE == 1
    float lambert = cosine;
#else
    vec3 shading = mat3(u_lv_from_o) * unpack_direction(packed_normal);
    float lambert = packed_normal == 0u ? cosine : dot(dot(shading, normal) < 0.0 ? -shading : shading, arriving.xyz);
#endif
    float share = cosine > 0.0 ? mix(1.0, lit, u_strength) : 0.0;
    sum += u_radiance * color * (max(lambert, 0.0) * arriving.w * share);
#if GLS_VISIBILITY
    o_visibility = lit;
#endif
#endif
#if GLS_SUM
    o_linear = vec4(sum, 1.0);
#endif
#if GLS_LAST
    o_color = vec4(srgb(clamp(sum, 0.0, 1.0)), 1.0);
#else
    o_color = vec4(sum, 1.0);
#endif
}
