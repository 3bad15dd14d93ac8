// One light on every visible surface: position from depth, normal from the triangle, visibility from <shadow>, Lambert shading.
// Everything happens in the light's axes. GLS_FIRST: adds the ambient term, else what earlier lights left. GLS_LAST: writes the
// display image, else the sum so far.
#ifndef GLS_SURFACE
#define GLS_SURFACE 1
#endif
#ifndef GLS_COLORS
#define GLS_COLORS 0 // base colour: 0 one for all, 1 per node, 2 per pixel (textures; needs 4 channels)
#endif
#ifndef GLS_ORTHO
#define GLS_ORTHO 0 // 1: an orthographic camera
#endif
#ifndef GLS_SUN
#define GLS_SUN 0
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
#ifndef GLS_WEAK
#define GLS_WEAK 0 // 1: a shadow takes away u_strength of the light, not all of it
#endif
#ifndef GLS_VISIBILITY
#define GLS_VISIBILITY 1 // also writes the light's visibility
#endif
#ifndef GLS_SUM
#define GLS_SUM 0 // also writes the linear sum
#endif
#ifndef GLS_EXACT
#define GLS_EXACT 0 // 1: <shadow> is receiver/exact.glsl, and the receiver lies where the ray meets its triangle
#endif
#include "lib/sight.glsl"
#include "lib/direction.glsl"
#include "lib/color_packing.glsl"
#include "lib/srgb.glsl"
#include "lib/surface_number.glsl"
#include <light>
#include <shadow>
#include "lib/asked.glsl"
#if GLS_EXACT
#include "lib/surface_point.glsl"
#endif

uniform usampler2D u_surface;
uniform sampler2D u_camera_depth;
#if !GLS_EXACT
uniform samplerBuffer u_planes; // per drawn triangle: unit world normal, distance from the scene's origin
#endif
#if GLS_COLORS == 1
uniform usamplerBuffer u_owners; // per drawn triangle: its node
uniform samplerBuffer u_colors; // per node: base colour, linear
#endif
uniform sampler2D u_sum; // linear light of earlier passes
flat in vec2 v_unproject; // this and what follows: see resolve.vert
flat in vec3 v_lv_from_l;
flat in vec3 v_forward_l;
flat in mat3 v_axes_l;
flat in vec3 v_towards_w;
flat in vec3 v_radiance; // the base colour is in these two where all share one
flat in vec3 v_ambient;
#if GLS_WEAK
uniform float u_strength;
#endif

layout(location = 0) out vec4 o_color;
#if GLS_VISIBILITY
layout(location = 1) out float o_visibility;
#endif
#if GLS_SUM
layout(location = 2) out vec4 o_linear;
#endif

vec3 towards_w(vec3 towards_l) {
#if GLS_SUN
    return v_towards_w;
#else
    return towards_l * v_axes_l; // transposed: back to world axes
#endif
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uvec4 surface = texelFetch(u_surface, pixel, 0);
    int triangle = triangle_of(surface.r);
#if GLS_COLORS == 2
    vec3 color = unpack_color(surface.b);
#elif GLS_COLORS == 1
    vec3 color = texelFetch(u_colors, int(texelFetch(u_owners, triangle).r)).rgb;
#else
    const vec3 color = vec3(1.0); // is in v_ambient and v_radiance
#endif
#if GLS_FIRST
    vec3 light = v_ambient;
    vec3 sum = vec3(0.0);
#else
    vec3 light = vec3(0.0);
    vec3 sum = texelFetch(u_sum, pixel, 0).rgb;
#endif
#if GLS_LIT
#if GLS_EXACT
    Facet own = facet(triangle);
    vec3 normal = own.normal;
    vec3 position = surface_point(triangle, own, v_eye_l, v_ray_l, v_forward_l);
    vec3 normal_w = normal * v_axes_l;
    receiver_triangle = triangle;
    receiver_corner = plane_corner(own);
#else
    vec4 plane = texelFetch(u_planes, triangle);
    vec3 normal_w = plane.xyz;
    vec3 normal = v_axes_l * normal_w;
#if GLS_ORTHO
    vec3 position = v_eye_l + v_ray_l * (v_unproject.x + v_unproject.y * texelFetch(u_camera_depth, pixel, 0).r);
#else
    vec3 position = v_eye_l + v_ray_l * (1.0 / (v_unproject.x + v_unproject.y * texelFetch(u_camera_depth, pixel, 0).r));
#endif
    // Depth was interpolated between vertices snapped to 1/256 pixel: back on the plane, without leaving the triangle's
    // depth range as ray x plane would where the ray misses the triangle by a hair.
    position += normal * (plane.w - dot(normal, position)) + v_lv_from_l;
#endif
    float side = dot(normal, v_ray_l) > 0.0 ? -1.0 : 1.0; // the side that is seen
    normal *= side;
    vec4 arriving = light_arriving(position);
    float cosine = dot(normal, arriving.xyz);
    float lit = asked_visibility(surface.r, position, normal, cosine);
    float lambert = cosine;
#if GLS_SURFACE > 1
    if (surface.g != 0u) { // an interpolated normal, on the same side
        vec3 shading = unpack_direction(surface.g);
        lambert = dot(shading, towards_w(arriving.xyz)) * inversesqrt(dot(shading, shading));
        lambert = dot(shading, normal_w) * side < 0.0 ? -lambert : lambert;
    }
#endif
#if GLS_WEAK
    float share = cosine > 0.0 ? 1.0 - u_strength * (1.0 - lit) : 0.0;
#else
    float share = lit;
#endif
    light += v_radiance * (max(lambert, 0.0) * arriving.w * share);
#if GLS_VISIBILITY
    o_visibility = lit;
#endif
#endif
    sum += color * light;
#if GLS_SUM
    o_linear = vec4(sum, 1.0);
#endif
#if GLS_LAST
    o_color = vec4(srgb(clamp(sum, 0.0, 1.0)), 1.0);
#else
    o_color = vec4(sum, 1.0);
#endif
}
