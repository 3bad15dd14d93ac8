// One triangle over the whole image, at the far plane: the depth test then skips the background.
uniform float u_far_z; // NDC z of the far plane
const vec2 corner[3] = vec2[3](vec2(-1.0, -1.0), vec2(3.0, -1.0), vec2(-1.0, 3.0));

void main() {
    gl_Position = vec4(corner[gl_VertexID], u_far_z, 1.0);
}
