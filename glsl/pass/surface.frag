// The camera pass: writes the triangle ID, counted from 1 across the scene, and, where the scene needs them, the shading normal (0: the
// triangle's own) and the base colour. Everything else follows from the triangle and the depth.
#ifndef GLS_SURFACE
#define GLS_SURFACE 1 // channels: 1 triangle; 2 and normal; 4 and colour
#endif
#ifndef GLS_TEXTURED
#define GLS_TEXTURED 0
#endif
#ifndef GLS_COLORED
#define GLS_COLORED 0 // 1: colours of vertices
#endif
#ifndef GLS_SMOOTH
#define GLS_SMOOTH 0
#endif
#ifndef GLS_ALPHA
#define GLS_ALPHA 0
#endif
#ifndef GLS_LOD
#define GLS_LOD 0.0 // mip bias for multisampling, so that textures are filtered for the pixel
#endif
#ifndef GLS_CONSERVATIVE
#define GLS_CONSERVATIVE 0 // 1: draws triangles enlarged by pass/surface.geom, and tests the pixels' own rays against them
#endif
#ifndef GLS_ORTHO
#define GLS_ORTHO 0
#endif
#ifndef GLS_PEEL
#define GLS_PEEL 0 // 1: draws a layer of blended surfaces: the nearest fragments behind those of the layer before, see lib/peel.glsl
#endif
#ifndef GLS_TRANSMISSION_MAP
#define GLS_TRANSMISSION_MAP 0
#endif
#include "lib/direction.glsl"
#include "lib/color_packing.glsl"
#include "lib/surface_number.glsl"
#if GLS_PEEL
#include "lib/peel.glsl"
#endif
#if GLS_CONSERVATIVE
#include "lib/ray_triangle.glsl"
uniform mat3 u_ray_l; // u_ray_l * (NDC x, y, 1): ray of unit view depth; GLS_ORTHO: its start, from the eye
uniform vec3 u_eye_l; // relative to the scene's origin
uniform mat3 u_ray_rest; // what float cuts off of both
uniform vec3 u_eye_rest;
#if GLS_ORTHO
uniform vec3 u_forward_l; // the camera looks along
uniform vec3 u_forward_rest;
#endif
uniform vec2 u_half_size; // of the image, in pixels
flat in int t_triangle;
#else
flat in int v_triangle;
#endif
#if GLS_SURFACE == 1
layout(location = 0) out uint o_surface;
#elif GLS_SURFACE == 2
layout(location = 0) out uvec2 o_surface;
#else
layout(location = 0) out uvec4 o_surface;
#endif
#if GLS_SURFACE == 4 || GLS_ALPHA || GLS_PEEL
uniform vec4 u_color; // linear factor
#endif
#if GLS_ALPHA
uniform float u_cutoff;
#endif
#if GLS_CONSERVATIVE
#if GLS_COLORED
flat in vec4 t_color[3];
#endif
#if GLS_SMOOTH
flat in vec3 t_normal_w[3];
#endif
#if GLS_TEXTURED
flat in vec2 t_uv[3];
#endif
#else
#if GLS_COLORED
in vec4 v_color;
#endif
#if GLS_SMOOTH
in vec3 v_normal_w;
#endif
#if GLS_TEXTURED
in vec2 v_uv;
#endif
#endif
#if GLS_TEXTURED
uniform sampler2D u_texture; // sRGB format: decoded before it is filtered
#endif

#if GLS_CONSERVATIVE
// the attribute that GL would interpolate, at the point where the ray hits the triangle
Hit hit;
int v_triangle;
#if GLS_SMOOTH
vec3 v_normal_w;
#endif
#if GLS_COLORED
vec4 v_color;
#endif
#if GLS_TEXTURED
vec2 v_uv;

vec2 uv_of(vec3 weights) {
    return weights.x * t_uv[0] + weights.y * t_uv[1] + weights.z * t_uv[2];
}
#endif
#endif

#if GLS_PEEL
vec4 kept; // what the surface lets through, and its own share
#endif

bool exists(out uvec4 surface) { // false: discarded by the alpha test
    uint triangle = uint(v_triangle);
#if GLS_SMOOTH
    uint normal = pack_direction(v_normal_w);
#else
    uint normal = 0u;
#endif
    surface = uvec4(triangle, normal, 0u, 0u);
#if GLS_SURFACE == 4 || GLS_ALPHA || GLS_PEEL
    vec4 color = u_color;
#if GLS_COLORED
    color *= v_color;
#endif
#if GLS_ALPHA && GLS_TEXTURED
    // Alpha of the finest level, as in the caster pass: mip levels would shrink foliage with distance.
    if (textureLod(u_texture, v_uv, 0.0).a * color.a < u_cutoff) return false;
#elif GLS_ALPHA
    if (color.a < u_cutoff) return false;
#endif
#if GLS_TEXTURED && GLS_SURFACE == 4
#if GLS_CONSERVATIVE
    vec2 right = uv_of(weights_beside(hit, u_right_l)) - v_uv, up = uv_of(weights_beside(hit, u_up_l)) - v_uv;
    color *= textureGrad(u_texture, v_uv, exp2(GLS_LOD) * right, exp2(GLS_LOD) * up);
#else
    color *= texture(u_texture, v_uv, GLS_LOD);
#endif
#endif
#if GLS_PEEL
    float transmission = u_transmission;
#if GLS_TRANSMISSION_MAP
    transmission *= texture(u_transmission_map, v_uv).r;
#endif
    kept = kept_of(color, transmission);
    if (kept.a <= 0.0) return false;
    color.rgb *= 1.0 - transmission; // what is transmitted is not scattered
#endif
    surface.b = pack_color(color.rgb);
#endif
    return true;
}

void main() {
    uvec4 surface = uvec4(0u);
#if GLS_CONSERVATIVE
    REAL3 ndc = REAL3(REAL2(gl_FragCoord.xy) / REAL2(u_half_size) - 1.0, 1.0);
    REAL3 eye = REAL3(u_eye_l) + REAL3(u_eye_rest), ray = REAL_MAT3(u_ray_l) * ndc + REAL_MAT3(u_ray_rest) * ndc;
#if GLS_ORTHO
    eye += ray;
    ray = REAL3(u_forward_l) + REAL3(u_forward_rest);
#endif
    v_triangle = t_triangle;
    hit = ray_triangle(triangle_of(uint(t_triangle)), eye, ray);
#if GLS_SMOOTH
    v_normal_w = t_normal_w[0] * hit.weights.x + t_normal_w[1] * hit.weights.y + t_normal_w[2] * hit.weights.z;
#endif
#if GLS_COLORED
    v_color = t_color[0] * hit.weights.x + t_color[1] * hit.weights.y + t_color[2] * hit.weights.z;
#endif
#if GLS_TEXTURED
    v_uv = uv_of(hit.weights);
#endif
    if (!hit.met || !exists(surface)) discard;
#else
    if (!exists(surface)) discard;
#endif
#if GLS_PEEL
    if (!is_next(surface.r)) discard;
    o_kept = kept;
#endif
#if GLS_SURFACE == 1
    o_surface = surface.r;
#elif GLS_SURFACE == 2
    o_surface = surface.rg;
#else
    o_surface = surface;
#endif
}
