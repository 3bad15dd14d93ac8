// Vertex shader of the camera pass: draws a mesh into the surface buffer.
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
#ifndef GLS_INSTANCED
#define GLS_INSTANCED 0 // 1: many nodes with one mesh
#endif
GLS_ATTRIBUTE vec3 a_position; // mesh space, relative to the mesh's origin
#if GLS_INSTANCED
uniform usamplerBuffer u_instances; // float bits, seven texels each: columns of matrices, and the first triangle
uniform int u_first_instance;
#else
uniform mat4 u_clip_from_mesh;
uniform int u_first_triangle; // ID of the draw's first triangle, from 1
#endif
flat out int v_triangle; // of the last vertex, which is the k-th of triangle k
#if GLS_SMOOTH
GLS_ATTRIBUTE vec3 a_normal;
#if !GLS_INSTANCED
uniform mat3 u_normal_from_mesh; // to world axes
#endif
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

#if GLS_INSTANCED
vec4 column(int k) {
    return uintBitsToFloat(texelFetch(u_instances, 7 * (u_first_instance + gl_InstanceID) + k));
}
#endif

void main() {
#if GLS_INSTANCED
    mat4 clip_from_mesh = mat4(column(0), column(1), column(2), column(3));
    int first_triangle = int(texelFetch(u_instances, 7 * (u_first_instance + gl_InstanceID) + 4).w);
    mat3 normal_from_mesh = mat3(column(4).xyz, column(5).xyz, column(6).xyz);
#else
    mat4 clip_from_mesh = u_clip_from_mesh;
    int first_triangle = u_first_triangle;
#if GLS_SMOOTH
    mat3 normal_from_mesh = u_normal_from_mesh;
#endif
#endif
    v_triangle = first_triangle + gl_VertexID;
    gl_Position = clip_from_mesh * vec4(a_position, 1.0);
#if GLS_SMOOTH
    v_normal_w = normalize(normal_from_mesh * a_normal);
#endif
#if GLS_TEXTURED
    v_uv = a_uv;
#endif
#if GLS_COLORED
    v_color = a_color;
#endif
}
