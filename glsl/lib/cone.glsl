// The cone from a receiver to an area light. In its axes the receiver is the origin, z is height, 1 at a local light, and at height h the
// cone's radius is u_radius * h.
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
uniform float u_radius; // radius of the light: a tangent (directional light), or world units

#if GLS_AT_INFINITY
#define TO_CONE(axes, v) (v) // the frame of a directional light is the cone's
#else
#define TO_CONE(axes, v) ((axes) * (v))
#endif

mat3 cone_axes(vec3 position) { // of a local light's cone, from the light's frame
    vec3 middle = -position / dot(position, position), away = -position * inversesqrt(dot(position, position));
    vec3 right = normalize(cross(abs(away.x) < 0.6 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0), away));
    return transpose(mat3(right, cross(away, right), middle));
}
