// A camera's ray against a triangle of the scene, in world axes. Both triangles of an edge make the same of it, so that no ray passes
// between them. Needs pass/resolve.vert's uniforms of the ray, or those that pass/surface.frag declares. In float a ray is some 1e-5 pixel
// off, in double no more than vertices are rounded: 1e-7 pixel.
#ifndef GLS_ORTHO
#define GLS_ORTHO 0
#endif
#ifndef GLS_DOUBLE
#define GLS_DOUBLE 0 // 1: in double
#endif
#if GLS_DOUBLE
#define REAL double
#define REAL2 dvec2
#define REAL3 dvec3
#define REAL_MAT3 dmat3
#else
#define REAL float
#define REAL2 vec2
#define REAL3 vec3
#define REAL_MAT3 mat3
#endif
uniform usamplerBuffer u_corners; // per triangle: vertices, node
uniform samplerBuffer u_positions; // relative to the scene's origin; w: what float cut off, see below
uniform vec3 u_right_l; // how rays, or of an orthographic camera their starts, change from pixel to pixel
uniform vec3 u_up_l;
uniform float u_near; // in the unit
uniform float u_unit; // scale of world units, a power of two: prevents overflow and underflow of products

struct Hit {
    bool met;
    float along; // ray parameter times u_unit
    vec3 weights; // of the corners
    vec3 depths; // of the corners, along the ray
    REAL2 a, b, c; // the corners, seen along the ray
    vec3 right, up; // see seen_along
    float margin; // how far inside the triangle the ray is, in pixels; less than 0: outside
};

// right, up: u_right_l and u_up_l without their parts along the ray. A vertex seen along them depends on nothing but its place.
REAL2 seen_along(REAL3 place, REAL3 right, REAL3 up) {
    GLS_PRECISE REAL2 p = REAL2(place.x * right.x + place.y * right.y + place.z * right.z,
                                place.x * up.x + place.y * up.y + place.z * up.z);
    return p;
}

REAL3 areas(REAL2 p, REAL2 q, REAL2 r) {
    GLS_PRECISE REAL3 area = REAL3(q.x * r.y, r.x * p.y, p.x * q.y) - REAL3(q.y * r.x, r.y * p.x, p.y * q.x);
    return area;
}

// Three times eight bits more of a vertex, in w as a whole number: the first is worth half a unit in the last place of the largest
// coordinate. Twin: glshadow.gl.scene.world
vec3 rest_of(vec4 place) {
    vec3 size = abs(place.xyz);
    uint largest = floatBitsToUint(max(size.x, max(size.y, size.z))), bits = uint(place.w);
    float unit = uintBitsToFloat(largest & 0x7f800000u) * exp2(-31.0);
    return (vec3(uvec3(bits, bits >> 8u, bits >> 16u) & 255u) - 128.0) * unit;
}

REAL3 vertex(uint number, REAL3 eye) { // relative to the eye
    vec4 place = texelFetch(u_positions, int(number));
    return (REAL3(place.xyz) - eye + REAL3(rest_of(place))) * u_unit;
}

Hit ray_triangle(int triangle, REAL3 eye, REAL3 ray_) {
    Hit hit;
    REAL length2 = dot(ray_, ray_);
    REAL3 right = REAL3(u_right_l), up = REAL3(u_up_l);
    right -= ray_ * (dot(right, ray_) / length2);
    up -= ray_ * (dot(up, ray_) / length2);
    uvec4 corners = texelFetch(u_corners, triangle);
    REAL3 a_ = vertex(corners.x, eye), b_ = vertex(corners.y, eye), c_ = vertex(corners.z, eye);
    hit.a = seen_along(a_, right, up);
    hit.b = seen_along(b_, right, up);
    hit.c = seen_along(c_, right, up);
    REAL3 exact = areas(hit.a, hit.b, hit.c);
    bool mixed = min(exact.x, min(exact.y, exact.z)) < 0.0 && max(exact.x, max(exact.y, exact.z)) > 0.0;
    REAL sum = exact.x + exact.y + exact.z;
    hit.right = vec3(right);
    hit.up = vec3(up);
    hit.weights = vec3(exact / (sum == 0.0 ? 1.0 : sum));
    vec3 a = vec3(a_), b = vec3(b_), c = vec3(c_), ray = vec3(ray_), area = vec3(exact);
    vec2 p = vec2(hit.a), q = vec2(hit.b), r = vec2(hit.c);
    float whole = float(sum);
    hit.depths = vec3(dot(a, ray), dot(b, ray), dot(c, ray)) / float(length2);
    vec3 normal = cross(b - a, c - a);
    float slant = dot(normal, ray);
    hit.along = dot(normal, a) / (slant == 0.0 ? 1.0 : slant); // the weights of a triangle that reaches far are too coarse for it
    hit.met = !mixed && sum != 0.0 && slant != 0.0 && hit.along >= u_near;
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
    REAL2 moved = REAL2(dot(step_, hit.right), dot(step_, hit.up));
#if GLS_ORTHO
    REAL3 area = areas(hit.a - moved * u_unit, hit.b - moved * u_unit, hit.c - moved * u_unit);
#else
    REAL3 area = areas(hit.a - moved * hit.depths.x, hit.b - moved * hit.depths.y, hit.c - moved * hit.depths.z);
#endif
    REAL whole = area.x + area.y + area.z;
    return vec3(area / (whole == 0.0 ? 1.0 : whole));
}
