// Vertex shader for forward shading: draws a mesh from the camera, with position and normal in the light's frame.
#ifndef GLS_DERIVATIVES
#define GLS_DERIVATIVES 0 // 1: there is no a_normal; the fragment shader derives the normal
#endif
GLS_ATTRIBUTE vec3 a_position; // mesh space
uniform mat4 u_clip_from_mesh; // the camera's
uniform mat4 u_lv_from_mesh;
GLS_VARYING vec3 v_position_lv;
#if !GLS_DERIVATIVES
GLS_ATTRIBUTE vec3 a_normal; // of the face, the same at its three corners; either side, any length. Smooth normals cause light leaks
uniform mat3 u_normal_lv_from_mesh; // cofactors of the linear part of u_lv_from_mesh
GLS_VARYING vec3 v_normal_lv;
#endif

void main() {
    gl_Position = u_clip_from_mesh * vec4(a_position, 1.0);
    v_position_lv = (u_lv_from_mesh * vec4(a_position, 1.0)).xyz;
#if !GLS_DERIVATIVES
    v_normal_lv = u_normal_lv_from_mesh * a_normal;
#endif
}
