// The point where a camera ray hits a triangle, in the light's frame. A Newton step projects the point onto the triangle's plane; for a ray
// nearly parallel to the plane it is clamped to the triangle's depth range. Needs lib/facet.glsl.
// GLS_HUGE: some triangles are so long that the rounding of their vertices is visible; their plane then comes from float64.
// Twin: glshadow.reference.trace.trace(surface=)
#ifndef GLS_HUGE
#define GLS_HUGE 0
#endif
#if GLS_HUGE
uniform samplerBuffer u_planes; // per drawn triangle: unit world normal, distance from the scene's origin
uniform mat3 u_axes_l; // the light's axes
uniform vec3 u_lv_from_l; // the scene's origin in the light's frame
#endif

struct Plane {
    vec3 normal;
    vec3 corner; // a point of it
};

Plane exact_plane(int triangle, Facet own) {
#if GLS_HUGE
    vec4 plane = texelFetch(u_planes, max(triangle, 0));
    vec3 normal = u_axes_l * plane.xyz;
    return Plane(normal, u_lv_from_l + normal * plane.w);
#else
    return Plane(own.normal, own.a);
#endif
}

// forward: unit, viewing direction; ray: of unit view depth
vec3 surface_point(int triangle, Facet own, vec3 eye, vec3 ray, vec3 forward) {
    Plane plane = exact_plane(triangle, own);
    vec3 depth = vec3(dot(forward, own.a - eye), dot(forward, own.b - eye), dot(forward, own.c - eye));
    float slant = dot(plane.normal, ray);
    float along = dot(plane.normal, plane.corner - eye) / (slant == 0.0 ? 1.0 : slant);
    along = clamp(along, min(depth.x, min(depth.y, depth.z)), max(depth.x, max(depth.y, depth.z)));
    vec3 position = eye + ray * along;
    position -= plane.normal * dot(plane.normal, position - plane.corner);
    return position;
}

vec3 onto_plane(int triangle, Facet own, vec3 position) { // a point on a triangle, or beside it by rounding, moved into its plane
    Plane plane = exact_plane(triangle, own);
    return position - plane.normal * dot(plane.normal, position - plane.corner);
}

vec3 plane_corner(Facet own) { // the reference point of its plane
#if GLS_HUGE
    return u_lv_from_l;
#else
    return own.a;
#endif
}
