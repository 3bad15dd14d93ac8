// As many rows of blocks as there are collected pixels, a fragment for each of their points.
#ifndef GLS_COLUMNS
#define GLS_COLUMNS 4 // of a block: points of one pixel
#endif
#ifndef GLS_ROWS
#define GLS_ROWS 4
#endif
uniform usamplerBuffer u_edges; // how many pixels
uniform ivec2 u_size; // of the picture: blocks in a row, rows
uniform mat3 u_ray_l; // this and what follows: see resolve.vert
uniform vec3 u_eye_l;
uniform vec3 u_forward_l;
flat out mat3 v_ray_from_ndc;
flat out vec3 v_eye_l;
flat out vec3 v_forward_l;
flat out int v_count;

void main() {
    v_ray_from_ndc = u_ray_l;
    v_eye_l = u_eye_l;
    v_forward_l = u_forward_l;
    v_count = int(texelFetch(u_edges, 0).r);
    float rows = float((v_count + u_size.x - 1) / u_size.x) / float(u_size.y);
    vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1) * rows);
    gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}
