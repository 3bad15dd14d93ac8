// A camera ray against a triangle of the scene, in world axes. Both triangles of a shared edge compute the same for it, so that no ray
// slips between them. Needs the ray uniforms of pass/resolve.vert, or those that pass/surface.frag declares.
uniform usamplerBuffer u_corners; // per triangle: vertices, node
uniform samplerBuffer u_positions; // relative to the scene's origin
uniform vec3 u_right_l; // change of rays, or of an orthographic camera's ray starts, from pixel to pixel
uniform vec3 u_up_l;
uniform float u_near; // in the unit
uniform float u_unit; // scale of world units, a power of two: prevents overflow and underflow of products

struct Hit {
    bool met;
    float along; // ray parameter times u_unit
    vec3 weights; // of the corners
    vec3 depths; // of the corners, along the ray
    vec2 a, b, c; // the corners, seen along the ray
    vec3 right, up; // see seen_along
    float margin; // how far inside the triangle the ray is, in pixels; less than 0: outside
};

// right, up: u_right_l and u_up_l without their components along the ray. The result for a vertex depends on its position only.
vec2 seen_along(vec3 place, vec3 right, vec3 up) {
    GLS_PRECISE vec2 p = vec2(place.x * right.x + place.y * right.y + place.z * right.z,
                              place.x * up.x + place.y * up.y + place.z * up.z);
    return p;
}

vec3 areas(vec2 p, vec2 q, vec2 r) {
    GLS_PRECISE vec3 area = vec3(q.x * r.y, r.x * p.y, p.x * q.y) - vec3(q.y * r.x, r.y * p.x, p.y * q.x);
    return area;
}

Hit ray_triangle(int triangle, vec3 eye, vec3 ray) {
    Hit hit;
    float length2 = dot(ray, ray);
    hit.right = u_right_l - ray * (dot(u_right_l, ray) / length2);
    hit.up = u_up_l - ray * (dot(u_up_l, ray) / length2);
    uvec4 corners = texelFetch(u_corners, triangle);
    vec3 a = (texelFetch(u_positions, int(corners.x)).xyz - eye) * u_unit;
    vec3 b = (texelFetch(u_positions, int(corners.y)).xyz - eye) * u_unit;
    vec3 c = (texelFetch(u_positions, int(corners.z)).xyz - eye) * u_unit;
    vec2 p = seen_along(a, hit.right, hit.up), q = seen_along(b, hit.right, hit.up), r = seen_along(c, hit.right, hit.up);
    vec3 area = areas(p, q, r);
    float whole = area.x + area.y + area.z;
    hit.a = p;
    hit.b = q;
    hit.c = r;
    hit.weights = area / (whole == 0.0 ? 1.0 : whole);
    hit.depths = vec3(dot(a, ray), dot(b, ray), dot(c, ray)) / length2;
    vec3 normal = cross(b - a, c - a);
    float slant = dot(normal, ray);
    hit.along = dot(normal, a) / (slant == 0.0 ? 1.0 : slant); // the weights of a very long triangle are too coarse for it
    bool mixed = min(area.x, min(area.y, area.z)) < 0.0 && max(area.x, max(area.y, area.z)) > 0.0;
    hit.met = !mixed && whole != 0.0 && slant != 0.0 && hit.along >= u_near;
    vec3 inside = area * (whole < 0.0 ? -1.0 : 1.0) * inversesqrt(max(vec3(dot(r - q, r - q), dot(p - r, p - r), dot(q - p, q - p)), 1e-37));
#if GLS_ORTHO
    hit.margin = min(inside.x, min(inside.y, inside.z)) / (dot(hit.right, hit.right) * u_unit);
#else
    hit.margin = min(inside.x, min(inside.y, inside.z)) / (dot(hit.right, hit.right) * max(hit.along, 1e-37));
#endif
    return hit;
}

// The corners' weights where the ray of a neighbouring pixel, a step of u_right_l and u_up_l away, hits the triangle's plane.
vec3 weights_beside(Hit hit, vec3 step_) {
    vec2 moved = vec2(dot(step_, hit.right), dot(step_, hit.up));
#if GLS_ORTHO
    vec3 area = areas(hit.a - moved * u_unit, hit.b - moved * u_unit, hit.c - moved * u_unit);
#else
    vec3 area = areas(hit.a - moved * hit.depths.x, hit.b - moved * hit.depths.y, hit.c - moved * hit.depths.z);
#endif
    float whole = area.x + area.y + area.z;
    return area / (whole == 0.0 ? 1.0 : whole);
}
