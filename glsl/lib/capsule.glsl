// A capsule: all points not farther than a radius from a segment; a ball is a capsule whose ends coincide. In the facet buffer its texels
// are (a, CAPSULE), (b, 0), (radius, 0, 0, 0); among world triangles its vertices are a, b and (radius, 0, 0); its plane is (CAPSULE, 0, 0, 0).
#ifndef GLS_CAPSULES
#define GLS_CAPSULES 0 // 1: the scene has balls; 2: also tubes
#endif
const float CAPSULE = 2.0; // larger than a component of a unit normal

struct Capsule {
    vec3 a;
    vec3 b;
    float radius;
};

struct CapsuleHit { // where a ray enters a capsule
    bool met;
    float along; // ray parameter
    float share; // of the way from a to b, of the point of the axis below
    vec3 position;
    vec3 normal; // unit, outward
};

bool is_capsule(float first) { // first: the w of its first texel, or the x of its plane or of its facet's normal
    return first > 1.5;
}

// The ray starts at the point nearest to the capsule's middle: products are then of the capsule's size, not of the distance to the eye
// (Haines, Gunther, Akenine-Moeller 2019, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, chapter 7). A ray that misses
// by rounding gives the nearest point of the surface.
CapsuleHit capsule_hit(Capsule c, vec3 eye, vec3 ray) {
    CapsuleHit hit;
    float length2 = dot(ray, ray), r2 = c.radius * c.radius;
    hit.share = 0.0;
    vec3 axis = c.a;
    float before = dot(axis - eye, ray) / length2;
    vec3 aside = eye + ray * before - axis; // from the centre
    aside -= ray * (dot(aside, ray) / length2);
    float inside = r2 - dot(aside, aside);
    hit.met = inside >= 0.0;
    float back = sqrt(max(inside, 0.0) / length2);
    hit.along = before - back;
    vec3 out_ = aside - ray * back;
#if GLS_CAPSULES == 2
    vec3 other = c.b - eye;
    float last = dot(other, ray) / length2;
    vec3 beyond = other - ray * last; // from the ray to b
    inside = r2 - dot(beyond, beyond);
    back = sqrt(max(inside, 0.0) / length2);
    bool nearer = inside >= 0.0 && (!hit.met || last - back < hit.along);
    hit.met = hit.met || inside >= 0.0;
    hit.along = nearer ? last - back : hit.along;
    out_ = nearer ? -beyond - ray * back : out_;
    hit.share = nearer ? 1.0 : 0.0;
    // Products below are of the sixth power of lengths: in units of the power of two next to the largest, they neither vanish nor overflow
    vec3 d = beyond + aside;
    vec3 most = max(max(abs(d), abs(aside)), abs(ray * (last - before)));
    uint bits = min(max(floatBitsToUint(max(max(most.x, most.y), max(most.z, c.radius))) & 0x7f800000u, 0x00800000u), 0x7e000000u);
    float size_ = uintBitsToFloat(bits), unit = uintBitsToFloat(0x7f000000u - bits);
    d *= unit;
    // the cylinder between, where the segment and the ray are seen along the ray: the point of the axis moves by d, the ray's parameter by slope
    float d2 = dot(d, d), slope = (last - before) * unit, radius = c.radius * unit, whole2 = d2 + slope * slope * length2;
    vec3 start = -aside * unit; // from the ray to a
    // w = t ray - start, from a to the ray's point t: its distance from the infinite axis is the radius
    float sd = dot(start, d);
    vec3 turn = cross(d, start);
    float root = d2 * (radius * radius) - dot(turn, turn);
    float t = (-slope * sd - sqrt(max(root, 0.0) * whole2 / length2)) / (d2 > 0.0 ? d2 : 1.0);
    float s = (t * slope * length2 - sd) / (whole2 > 0.0 ? whole2 : 1.0); // share of the axis below
    bool wall = d2 > 1e-10 * whole2 && root >= 0.0 && s > 0.0 && s < 1.0 && (!hit.met || before + t * size_ < hit.along);
    hit.met = hit.met || wall;
    hit.along = wall ? before + t * size_ : hit.along;
    out_ = wall ? (ray * (t - s * slope) - start - s * d) * size_ : out_;
    hit.share = wall ? s : hit.share;
    axis = hit.share == 1.0 ? c.b : c.a + hit.share * (c.b - c.a);
#endif
    float size = length(out_);
    hit.normal = size > 0.0 ? out_ / size : -ray * inversesqrt(length2);
    hit.position = axis + hit.normal * c.radius;
    return hit;
}
