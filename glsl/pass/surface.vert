// Draws a mesh from the camera into the surface buffer.
#ifndef GLS_SURFACE
#define GLS_SURFACE 1
#endif
#ifndef GLS_TEXTURED
#define GLS_TEXTURED 0
#endif
#ifndef GLS_COLORED
#define GLS_COLORED 0
#endif
#ifndef GLS_SMOOTH
#define GLS_SMOOTH 0
#endif
GLS_ATTRIBUTE vec3 a_position; // mesh space, relative to the mesh's origin
uniform mat4 u_clip_from_mesh;
uniform int u_first_triangle; // number of the draw's first triangle, from 1
flat out int v_triangle; // of the last vertex, which is the k-th of triangle k
#if GLS_SMOOTH
GLS_ATTRIBUTE vec3 a_normal;
uniform mat3 u_normal_from_mesh; // to world axes
GLS_VARYING vec3 v_normal_w;
#endif
#if GLS_TEXTURED
GLS_ATTRIBUTE vec2 a_uv;
GLS_VARYING vec2 v_uv;
#endif
#if GLS_COLORED
GLS_ATTRIBUTE vec4 a_color; // linear
GLS_VARYING vec4 v_color;
#endif

void main() {
    v_triangle = u_first_triangle + gl_VertexID;
    gl_Position = u_clip_from_mesh * vec4(a_position, 1.0);
#if GLS_SMOOTH
    v_normal_w = normalize(u_normal_from_mesh * a_normal);
#endif
#if GLS_TEXTURED
    v_uv = a_uv;
#endif
#if GLS_COLORED
    v_color = a_color;
#endif
}
