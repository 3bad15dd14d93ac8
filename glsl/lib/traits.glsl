// Per-node traits for passes over all triangles of a light. Twin: glshadow.gl.techniques.listed
const uint CULL_BACK = 1u, CULL_FRONT = 2u, CASTS = 4u, CUT_OUT = 8u, ROUND = 16u; // flags
uniform usamplerBuffer u_corners; // per triangle: vertices, node
uniform usamplerBuffer u_traits; // per node: flags, shift from a triangle's number to 1 + its number among masked triangles
uniform uvec3 u_part; // range of triangles: first, end, stride

uint own_triangle() { // may be past the end
    return u_part.x + u_part.z * (gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * (64u * 65535u));
}

uvec2 traits_of(uint triangle) {
    return texelFetch(u_traits, int(texelFetch(u_corners, int(triangle)).w)).xy;
}
