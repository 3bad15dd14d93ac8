// One triangle over the whole image, at the far plane: the depth test then skips the background.
uniform float u_far_z; // NDC z of the far plane
uniform mat3 u_ray_l; // ray of unit view depth at the corners = u_ray_l * (NDC x, y, 1), in the light's axes
noperspective out vec3 v_ray_l; // linear over the image: cheaper than nine uniforms in every pixel
const vec2 corner[3] = vec2[3](vec2(-1.0, -1.0), vec2(3.0, -1.0), vec2(-1.0, 3.0));

void main() {
    v_ray_l = u_ray_l * vec3(corner[gl_VertexID], 1.0);
    gl_Position = vec4(corner[gl_VertexID], u_far_z, 1.0);
}
