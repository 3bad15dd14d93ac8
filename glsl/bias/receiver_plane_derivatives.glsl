// The receiver's plane from screen-space derivatives, for programs without face normals. In forward passes only: a neighbour in a buffer
// may be another surface. ES 1.00 needs GLS_DERIVATIVES, which enables GL_OES_standard_derivatives.
//   n = dP/dx x dP/dy;   gradient of depth over (u, v) = -(n.u, n.v) / n.depth, from P in light view or in map space
// Tuft 2010, "Cascaded Shadow Maps"; Luna 2016, section 20.5. Twin: glshadow.shadows.bias.receiver_plane_from_derivatives

// Gradient from the derivatives of (u, v, depth); 0 where the plane is edge-on to the light.
vec2 receiver_plane_from_derivatives(vec3 duvz_dx, vec3 duvz_dy) {
    vec3 n = cross(duvz_dx, duvz_dy);
    float terms = abs(duvz_dx.x * duvz_dy.y) + abs(duvz_dx.y * duvz_dy.x);
    return abs(n.z) <= terms * 9.5367432e-7 ? vec2(0.0) : -n.xy / n.z; // 2^-20
}

// Unit normal, of either side, for light_visibility; also defined where a gradient would be infinite.
vec3 normal_from_derivatives(vec3 position_lv) {
    vec3 n = cross(dFdx(position_lv), dFdy(position_lv));
    vec3 size = abs(n);
    n /= max(max(size.x, max(size.y, size.z)), 1e-30); // its square may be below the smallest float
    return n * inversesqrt(max(dot(n, n), 1e-30));
}
