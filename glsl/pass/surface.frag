// What the camera sees: the number of the drawn triangle, counted from 1 across the scene, and, where the scene needs them, the
// shading normal (0: the triangle's own) and the base colour. Everything else follows from the triangle and the depth.
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
#define GLS_LOD 0.0 // of several samples in a pixel: the texture is that of the pixel
#endif
#include "lib/direction.glsl"
#include "lib/color_packing.glsl"
flat in int v_triangle;
#if GLS_SURFACE == 1
layout(location = 0) out uint o_surface;
#elif GLS_SURFACE == 2
layout(location = 0) out uvec2 o_surface;
#else
layout(location = 0) out uvec4 o_surface;
#endif
#if GLS_SURFACE == 4 || GLS_ALPHA
uniform vec4 u_color; // linear factor
#endif
#if GLS_ALPHA
uniform float u_cutoff;
#endif
#if GLS_COLORED
in vec4 v_color;
#endif
#if GLS_SMOOTH
in vec3 v_normal_w;
#endif
#if GLS_TEXTURED
in vec2 v_uv;
uniform sampler2D u_texture; // sRGB format: decoded before it is filtered
#endif

void main() {
    uint triangle = uint(v_triangle);
#if GLS_SMOOTH
    uint normal = pack_direction(v_normal_w);
#else
    uint normal = 0u;
#endif
#if GLS_SURFACE == 4 || GLS_ALPHA
    vec4 color = u_color;
#if GLS_COLORED
    color *= v_color;
#endif
#if GLS_ALPHA && GLS_TEXTURED
    // Alpha of the finest level, as in the caster pass: averaged levels would shrink foliage with distance.
    if (textureLod(u_texture, v_uv, 0.0).a * color.a < u_cutoff) discard;
#elif GLS_ALPHA
    if (color.a < u_cutoff) discard;
#endif
#if GLS_TEXTURED && GLS_SURFACE == 4
    color *= texture(u_texture, v_uv, GLS_LOD);
#endif
#endif
#if GLS_SURFACE == 1
    o_surface = triangle;
#elif GLS_SURFACE == 2
    o_surface = uvec2(triangle, normal);
#else
    o_surface = uvec4(triangle, normal, pack_color(color.rgb), 0u);
#endif
}
