// Where a camera's ray meets a triangle's plane, in the light's frame; where it misses the triangle (GL snaps vertices to 1/256 pixel)
// and looks along its plane, no further than the triangle reaches. A Newton step takes it back to the plane. Needs lib/facet.glsl.
// Twin: glshadow.reference.trace.trace(surface=)
vec3 surface_point(Facet own, vec3 eye, vec3 ray, vec3 forward) { // forward: unit, along the view; ray: of unit view depth
    vec3 depth = vec3(dot(forward, own.a - eye), dot(forward, own.b - eye), dot(forward, own.c - eye));
    float slant = dot(own.normal, ray);
    float along = dot(own.normal, own.a - eye) / (slant == 0.0 ? 1.0 : slant);
    along = clamp(along, min(depth.x, min(depth.y, depth.z)), max(depth.x, max(depth.y, depth.z)));
    vec3 position = eye + ray * along;
    return position - own.normal * dot(own.normal, position - own.a);
}
