// Vertex shader of the caster pass: draws a mesh from the light. GLS_METRIC: outputs for the metric. GLS_ALPHA: outputs for the alpha test.
#ifndef GLS_METRIC
#define GLS_METRIC 0
#endif
#ifndef GLS_ALPHA
#define GLS_ALPHA 0
#endif
#ifndef GLS_TEXTURED
#define GLS_TEXTURED 0 // 1: alpha of the texture
#endif
#ifndef GLS_COLORED
#define GLS_COLORED 0 // 1: alpha of the vertices
#endif
#ifndef GLS_CLIP_BIAS
#define GLS_CLIP_BIAS 0
#endif
GLS_ATTRIBUTE vec3 a_position; // mesh space, relative to the mesh's origin
uniform mat4 u_clip_from_mesh;
#if GLS_METRIC
uniform mat4 u_view_from_mesh;
GLS_VARYING vec4 v_position_lc;
GLS_VARYING vec3 v_position_lv;
#endif
#if GLS_TEXTURED
GLS_ATTRIBUTE vec2 a_uv;
GLS_VARYING vec2 v_uv;
#endif
#if GLS_COLORED
GLS_ATTRIBUTE vec4 a_color;
GLS_VARYING float v_alpha;
#endif
#if GLS_CLIP_BIAS
#include "bias/clip_caster.glsl"
#endif

void main() {
    vec3 position = a_position;
#if GLS_CLIP_BIAS
    position = normal_biased(position);
#endif
    gl_Position = u_clip_from_mesh * vec4(position, 1.0);
#if GLS_METRIC
    v_position_lc = gl_Position;
    v_position_lv = (u_view_from_mesh * vec4(position, 1.0)).xyz;
#endif
#if GLS_CLIP_BIAS
    gl_Position.z = clip_biased(gl_Position);
#endif
#if GLS_TEXTURED
    v_uv = a_uv;
#endif
#if GLS_COLORED
    v_alpha = a_color.a;
#endif
}
