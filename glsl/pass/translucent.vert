// Draws a translucent mesh from the light.
#ifndef GLS_TEXTURED
#define GLS_TEXTURED 0
#endif
#ifndef GLS_COLORED
#define GLS_COLORED 0
#endif
in vec3 a_position; // mesh space, relative to the mesh's origin
uniform mat4 u_clip_from_mesh;
#if GLS_TEXTURED
in vec2 a_uv;
out vec2 v_uv;
#endif
#if GLS_COLORED
in vec4 a_color;
out vec4 v_color;
#endif

void main() {
    gl_Position = u_clip_from_mesh * vec4(a_position, 1.0);
#if GLS_TEXTURED
    v_uv = a_uv;
#endif
#if GLS_COLORED
    v_color = a_color;
#endif
}
