// The camera pass: writes the triangle ID, counted from 1 across the scene, and, where the scene needs them, the shading normal (0: the
// triangle's own), the base colour, what else the materials need, and emitted light. Everything else follows from the triangle and the
// depth.
#ifndef GLS_SURFACE
#define GLS_SURFACE 1 // channels: 1 triangle; 2 and normal; 4 and colour and material
#endif
#ifndef GLS_MATERIAL
#define GLS_MATERIAL 0 // 1: some materials of the scene are not matte, or have an occlusion map
#endif
#ifndef GLS_GLOSSY
#define GLS_GLOSSY 0 // 1: some are neither matte nor of roughness 1
#endif
#ifndef GLS_EMITS
#define GLS_EMITS 0 // 1: some emit light
#endif
#ifndef GLS_EMISSION
#define GLS_EMISSION 0 // this one: 1 a factor, 2 and a map, 3 its base colour (unlit)
#endif
#ifndef GLS_SETS
#define GLS_SETS 0 // 1: it has maps beside the base colour's texture
#endif
#ifndef GLS_NORMAL_MAP
#define GLS_NORMAL_MAP 0 // 1: with tangents of vertices, 2: of triangles, 3: and normals of triangles
#endif
#ifndef GLS_METALLIC_ROUGHNESS_MAP
#define GLS_METALLIC_ROUGHNESS_MAP 0
#endif
#ifndef GLS_OCCLUSION_MAP
#define GLS_OCCLUSION_MAP 0
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
#ifndef GLS_OCTAHEDRAL
#define GLS_OCTAHEDRAL 0
#endif
#if GLS_OCTAHEDRAL
#include "lib/octahedral.glsl"
#endif
#include "lib/direction.glsl"
#include "lib/color_packing.glsl"
#if GLS_MATERIAL
#include "lib/material_packing.glsl"
#endif
#if GLS_EMITS
#include "lib/emission_packing.glsl"
#if GLS_PEEL
layout(location = 2) out uint o_emission;
#else
layout(location = 1) out uint o_emission;
#endif
#endif
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
#if GLS_SETS
flat in vec4 t_sets[3];
#endif
#if GLS_NORMAL_MAP
flat in vec4 t_tangent_w[3];
flat in float t_side;
#endif
#else
#if GLS_COLORED
in vec4 v_color;
#endif
#if GLS_SMOOTH
#if GLS_NORMAL_MAP == 3
flat
#endif
in vec3 v_normal_w;
#endif
#if GLS_TEXTURED
in vec2 v_uv;
#endif
#if GLS_SETS
in vec4 v_sets; // both sets of texture coordinates
#endif
#if GLS_NORMAL_MAP
#if GLS_NORMAL_MAP > 1
flat
#endif
in vec4 v_tangent_w; // and the sign of the third axis
flat in float v_side; // -1: the node mirrors its mesh
#endif
#endif
#if GLS_TEXTURED
uniform sampler2D u_texture; // sRGB format: decoded before it is filtered
#endif
#if GLS_MATERIAL
uniform vec2 u_metallic_roughness;
#endif
#if GLS_EMISSION == 1 || GLS_EMISSION == 2
uniform vec3 u_emitted;
#endif
// a map's coordinates: place * both sets + offset
#if GLS_METALLIC_ROUGHNESS_MAP
uniform sampler2D u_metallic_roughness_map;
uniform mat4x2 u_metallic_roughness_map_place;
uniform vec2 u_metallic_roughness_map_offset;
#endif
#if GLS_NORMAL_MAP
uniform sampler2D u_normal_map;
uniform mat4x2 u_normal_map_place;
uniform vec2 u_normal_map_offset;
uniform float u_normal_scale;
#endif
#if GLS_OCCLUSION_MAP
uniform sampler2D u_occlusion_map;
uniform mat4x2 u_occlusion_map_place;
uniform vec2 u_occlusion_map_offset;
uniform float u_occlusion_strength;
#endif
#if GLS_EMISSION == 2
uniform sampler2D u_emission_map;
uniform mat4x2 u_emission_map_place;
uniform vec2 u_emission_map_offset;
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
#if GLS_SETS
vec4 v_sets;

vec4 sets_of(vec3 weights) {
    return weights.x * t_sets[0] + weights.y * t_sets[1] + weights.z * t_sets[2];
}
#endif
#if GLS_NORMAL_MAP
vec4 v_tangent_w;
float v_side;
#endif
#endif

#if GLS_PEEL
vec4 kept; // what the surface lets through, and its own share
#endif

#if GLS_SETS
vec4 map_at(sampler2D map, mat4x2 place, vec2 offset) {
#if GLS_CONSERVATIVE
    vec2 right = place * (sets_of(weights_beside(hit, u_right_l)) - v_sets), up = place * (sets_of(weights_beside(hit, u_up_l)) - v_sets);
    return textureGrad(map, place * v_sets + offset, exp2(GLS_LOD) * right, exp2(GLS_LOD) * up);
#else
    return texture(map, place * v_sets + offset, GLS_LOD);
#endif
}
#endif

#if GLS_NORMAL_MAP
vec3 mapped_normal() { // the side that it is on follows in pass/resolve.frag
    vec3 normal = normalize(v_normal_w) * v_side, tangent = v_tangent_w.xyz - normal * dot(normal, v_tangent_w.xyz);
    float length2 = dot(tangent, tangent);
    tangent *= inversesqrt(max(length2, 1e-30));
    vec3 third = cross(normal, tangent) * (v_tangent_w.w < 0.0 ? -v_side : v_side);
    vec3 shift = map_at(u_normal_map, u_normal_map_place, u_normal_map_offset).xyz * 2.0 - 1.0;
    vec3 mapped = (tangent * shift.x + third * shift.y) * u_normal_scale + normal * shift.z;
    return length2 > 1e-12 && dot(mapped, mapped) > 0.0 ? normalize(mapped) : normal;
}
#endif

#if GLS_GLOSSY && GLS_SMOOTH
float normal_change() { // of the smooth normal, from one pixel to the next
#if GLS_CONSERVATIVE
    vec3 normal = normalize(v_normal_w), to_right = weights_beside(hit, u_right_l), to_up = weights_beside(hit, u_up_l);
    vec3 right = normalize(t_normal_w[0] * to_right.x + t_normal_w[1] * to_right.y + t_normal_w[2] * to_right.z) - normal;
    vec3 up = normalize(t_normal_w[0] * to_up.x + t_normal_w[1] * to_up.y + t_normal_w[2] * to_up.z) - normal;
#else
    vec3 normal = normalize(v_normal_w), right = dFdx(normal), up = dFdy(normal);
#endif
    return sqrt(max(dot(right, right), dot(up, up)));
}
#endif

bool exists(out uvec4 surface, out uint emission) { // false: discarded by the alpha test
    uint triangle = uint(v_triangle);
#if GLS_NORMAL_MAP
    uint normal = pack_direction(mapped_normal());
#elif GLS_SMOOTH
    uint normal = pack_direction(v_normal_w);
#else
    uint normal = 0u;
#endif
    surface = uvec4(triangle, normal, 0u, 0u);
    emission = 0u;
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
    vec3 tint = color.rgb;
    float transmission = u_transmission;
#if GLS_TRANSMISSION_MAP
    transmission *= texture(u_transmission_map, v_uv).r;
#endif
#endif
#if GLS_EMISSION == 3
#if GLS_PEEL // what is transmitted is not emitted either
    emission = pack_emission(color.rgb * (1.0 - transmission));
#else
    emission = pack_emission(color.rgb);
#endif
    color.rgb = vec3(0.0);
#elif GLS_EMISSION == 2
    emission = pack_emission(u_emitted * map_at(u_emission_map, u_emission_map_place, u_emission_map_offset).rgb);
#elif GLS_EMISSION == 1
    emission = pack_emission(u_emitted);
#endif
#if GLS_PEEL
    kept = kept_of(vec4(tint, color.a), transmission);
    if (kept.a <= 0.0) return false;
    color.rgb *= 1.0 - transmission; // what is transmitted is not scattered
#endif
    surface.b = pack_color(color.rgb);
#if GLS_MATERIAL
    vec4 material = vec4(1.0, u_metallic_roughness.yx, 1.0); // alpha, roughness (more than 1: matte), metallic, occlusion
#if GLS_METALLIC_ROUGHNESS_MAP
    material.yz *= map_at(u_metallic_roughness_map, u_metallic_roughness_map_place, u_metallic_roughness_map_offset).gb;
#endif
#if GLS_GLOSSY && GLS_SMOOTH
    // rougher where the normal changes from pixel to pixel: a highlight smaller than a pixel would flicker
    material.y = material.y > 1.0 ? material.y : min(material.y + exp2(GLS_LOD) * normal_change(), 1.0);
#endif
#if GLS_OCCLUSION_MAP
    material.w += u_occlusion_strength * (map_at(u_occlusion_map, u_occlusion_map_place, u_occlusion_map_offset).r - 1.0);
#endif
    surface.a = pack_material(material);
#endif
#endif
    return true;
}

void main() {
    uvec4 surface = uvec4(0u);
    uint emission = 0u;
#if GLS_PEEL
    float slope = fwidth(gl_FragCoord.z);
#endif
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
#if GLS_SETS
    v_sets = sets_of(hit.weights);
#endif
#if GLS_NORMAL_MAP
    v_tangent_w = t_tangent_w[0] * hit.weights.x + t_tangent_w[1] * hit.weights.y + t_tangent_w[2] * hit.weights.z;
    v_side = t_side;
#endif
    if (!hit.met || !exists(surface, emission)) discard;
#else
    if (!exists(surface, emission)) discard;
#endif
#if GLS_EMITS
    o_emission = emission;
#endif
#if GLS_PEEL
    if (!is_next(surface.r, slope)) discard;
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
