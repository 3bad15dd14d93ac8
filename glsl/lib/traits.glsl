// What a light knows of a scene's nodes, for passes over all triangles. Twin: glshadow.gl.techniques.listed
const uint CULL_BACK = 1u, CULL_FRONT = 2u, CASTS = 4u, CUT_OUT = 8u; // flags
uniform usamplerBuffer u_corners; // per triangle: vertices, node
uniform usamplerBuffer u_traits; // per node: flags, what turns a triangle's number into its mask's: 1 + that among masked triangles
uniform uvec3 u_part; // triangles that are passed over: the first, the end, and one of how many

uint own_triangle() { // may lie beyond the end
    return u_part.x + u_part.z * (gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * (64u * 65535u));
}

uvec2 traits_of(uint triangle) {
    return texelFetch(u_traits, int(texelFetch(u_corners, int(triangle)).w)).xy;
}
