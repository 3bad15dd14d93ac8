// Whether a capsule lies between a receiver and the light. Included by exact/lists.glsl. A capsule is convex: a ray that starts on its surface and meets it
// lies on one side of its start, that of the point where the ray is nearest to the axis. Only inside it both sides count.
#ifndef GLS_CAPSULES
#define GLS_CAPSULES 0 // 1: the scene has balls; 2: also tubes
#endif
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
Capsule capsule_of(Facet f) {
    return Capsule(f.a, f.b, f.c.x);
}

bool capsule_blocks(Ray ray, Facet other) {
    vec3 p = ray.position, a = other.a, b = other.b;
    float radius = other.c.x;
#if GLS_AT_INFINITY
    vec3 a_ = vec3(a.xy - p.xy, 0.0), d_ = vec3(b.xy - a.xy, 0.0);
#else
    vec3 to_light = -p;
    float length2 = dot(p, p);
    vec3 a_ = a - p * (dot(a, p) / length2), d = b - a, d_ = d - p * (dot(d, p) / length2);
#endif
    // the point of the axis nearest to the ray
#if GLS_CAPSULES == 2
    float d2 = dot(d_, d_), s = d2 > 0.0 ? clamp(-dot(a_, d_) / d2, 0.0, 1.0) : 0.0;
    vec3 axis = a + s * (b - a);
    a_ += s * d_;
#else
    vec3 axis = a;
#endif
    if (dot(a_, a_) >= radius * radius) return false;
#if GLS_AT_INFINITY
    bool ahead = axis.z > p.z;
    bool around_light = false;
#else
    float along = dot(axis, p); // from the light, times the distance
    bool ahead = along > 0.0 && along < length2;
#if GLS_CAPSULES == 2
    float o2 = dot(b - a, b - a);
    vec3 near_light = a + (o2 > 0.0 ? clamp(-dot(a, b - a) / o2, 0.0, 1.0) : 0.0) * (b - a);
#else
    vec3 near_light = a;
#endif
    bool around_light = dot(near_light, near_light) < radius * radius;
#endif
    // the receiver itself inside, by more than rounding
    vec3 at = p - axis;
#if GLS_CAPSULES == 2
    float u2 = dot(b - a, b - a);
    at = p - a - (u2 > 0.0 ? clamp(dot(p - a, b - a) / u2, 0.0, 1.0) : 0.0) * (b - a);
#endif
    float bound = 4.0 * (ray.bound + u_bound.x) + 1e-6 * radius;
    return ahead || around_light || length(at) < radius - bound;
}
