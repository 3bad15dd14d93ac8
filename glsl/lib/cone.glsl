// The cone from a receiver to a light that has a size: in its axes the receiver is the origin, z is height, 1 at a lamp, and at height h
// the cone is u_radius * h wide.
#ifndef GLS_SUN
#define GLS_SUN 0
#endif
uniform float u_radius; // radius of the light: a tangent (a sun), or world units

#if GLS_SUN
#define TO_CONE(axes, v) (v) // a sun's frame is the cone's
#else
#define TO_CONE(axes, v) ((axes) * (v))
#endif

mat3 cone_axes(vec3 position) { // of a lamp's, from the light's frame
    vec3 middle = -position / dot(position, position), away = -position * inversesqrt(dot(position, position));
    vec3 right = normalize(cross(abs(away.x) < 0.6 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0), away));
    return transpose(mat3(right, cross(away, right), middle));
}
