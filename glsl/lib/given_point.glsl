// A receiver that is given as a point, not seen by a camera ray: one texel for each. Its triangle is in u_surface, as of the surface buffer;
// without one the point is free, on no surface.
// GLS_POINTS 1: points; 2: with normals, zero where none is given.
#ifndef GLS_POINTS
#define GLS_POINTS 0
#endif
uniform sampler2D u_places; // relative to the scene's origin, world axes; w: the side of its triangle, 1 that of its winding, -1 the other
#if GLS_POINTS == 2
uniform sampler2D u_normals; // world axes, any length
#endif
bool receiver_free = false; // a free point without a normal has no horizon: all of the light is above it

struct GivenPoint {
    vec3 position; // relative to the scene's origin, in the light's axes
    vec3 normal; // in the light's axes; zero: none
    float side;
};

GivenPoint given_point(ivec2 texel, mat3 axes) {
    vec4 place = texelFetch(u_places, texel, 0);
#if GLS_POINTS == 2
    vec3 normal = axes * texelFetch(u_normals, texel, 0).xyz;
#else
    const vec3 normal = vec3(0.0);
#endif
    return GivenPoint(axes * place.xyz, normal, place.w);
}

float given_side(GivenPoint given, vec3 face) { // of the triangle with that normal: the one to which the given normal points
    float towards = dot(given.normal, face);
    return towards > 0.0 ? 1.0 : towards < 0.0 ? -1.0 : given.side;
}
