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
#ifndef GLS_SETS
#define GLS_SETS 0
#endif
#ifndef GLS_NORMAL_MAP
#define GLS_NORMAL_MAP 0
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
#if GLS_NORMAL_MAP == 3
flat
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

#if GLS_SETS
GLS_ATTRIBUTE vec4 a_sets; // both sets of texture coordinates
GLS_VARYING vec4 v_sets;
#endif
#if GLS_NORMAL_MAP
GLS_ATTRIBUTE vec4 a_tangent; // and the sign of the third axis
#if GLS_NORMAL_MAP > 1
flat
#endif
GLS_VARYING vec4 v_tangent_w;
flat out float v_side;
#if !GLS_INSTANCED
uniform float u_side; // -1: the node mirrors its mesh
#endif
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
#if GLS_NORMAL_MAP
    float side = column(5).w;
#endif
#else
    mat4 clip_from_mesh = u_clip_from_mesh;
    int first_triangle = u_first_triangle;
#if GLS_SMOOTH
    mat3 normal_from_mesh = u_normal_from_mesh;
#endif
#if GLS_NORMAL_MAP
    float side = u_side;
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
#if GLS_SETS
    v_sets = a_sets;
#endif
#if GLS_NORMAL_MAP
    // normals are transformed by the cofactors of the node's matrix, and the cofactors of these are that matrix, but for a factor
    mat3 world_from_mesh = mat3(cross(normal_from_mesh[1], normal_from_mesh[2]), cross(normal_from_mesh[2], normal_from_mesh[0]),
                                cross(normal_from_mesh[0], normal_from_mesh[1]));
    vec3 tangent = side * (world_from_mesh * a_tangent.xyz);
    v_tangent_w = vec4(tangent * inversesqrt(max(dot(tangent, tangent), 1e-30)), a_tangent.w);
    v_side = side;
#endif
}
