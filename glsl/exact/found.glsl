// Slot <between>: which points of a light that has a size a receiver sees past the triangles that exact/region.glsl found. Needs lib/cone.glsl.
#ifndef GLS_POINT
#define GLS_POINT 0
#endif
#ifndef GLS_SUN
#define GLS_SUN 0
#endif
#ifndef GLS_MASKED
#define GLS_MASKED 0 // some casters are cut out by their texture
#endif
uniform usamplerBuffer u_found;
uniform samplerBuffer u_disc; // points of the light: a sun's (x, y) of rays (x, y, 1), else of the unit disc
uniform int u_count; // of them
const int TOGETHER = 16; // points that are asked at once
const uint ALL_HIDDEN = 0xffffffffu;

struct Disc { // of a lamp, as the receiver sees it
    vec3 right;
    vec3 up;
};

Disc disc_seen(vec3 position) { // turned with the receiver by the shortest way from an axis, so that there is a seam only opposite to it
#if GLS_POINT
    const vec3 axis = vec3(0.0, -1.0, 0.0), first = vec3(1.0, 0.0, 0.0), second = vec3(0.0, 0.0, 1.0);
#else
    const vec3 axis = vec3(0.0, 0.0, -1.0), first = vec3(1.0, 0.0, 0.0), second = vec3(0.0, 1.0, 0.0);
#endif
    vec3 away = normalize(position), both = (axis + away) / max(1.0 + dot(axis, away), 1e-6);
    return Disc(u_reach * (first - dot(first, away) * both), u_reach * (second - dot(second, away) * both));
}

vec3 source(int k, Disc disc) { // of a ray, see Ray
    vec2 point = texelFetch(u_disc, k).xy;
#if GLS_SUN
    return vec3(point, 1.0);
#else
    return disc.right * point.x + disc.up * point.y;
#endif
}

void aim(inout Ray ray) {
#if !GLS_SUN
    vec3 away = ray.position - ray.source;
    float axis = face_axis(away), s = face_side(away, axis);
    vec3 right = face_right(axis, s), up = face_up(axis, s), backward = face_backward(axis, s);
    float distance = -dot(backward, away);
    ray.right = right + dot(right, away) / distance * backward;
    ray.up = up + dot(up, away) / distance * backward;
#endif
}

int seen_points(vec3 position, vec3 normal, uint list, int first, int step) { // how many, of every so-manieth point
    Ray ray;
    ray.position = position;
    ray.bound = receiver_bound(position);
    Disc disc = disc_seen(position);
    uint open = 0u;
    for (int i = 0; i < TOGETHER; i++) {
        int k = first + i * step;
        vec3 point = source(min(k, u_count - 1), disc);
#if !GLS_SUN
        point -= position;
#endif
        open |= k < u_count && dot(normal, point) > 0.0 ? 1u << uint(i) : 0u; // above the horizon
    }
    open = list == ALL_HIDDEN ? 0u : open;
    uint link = open == 0u ? 0u : list;
    while (link != 0u) {
        uvec4 entry = texelFetch(u_found, int(link) - 1);
        Facet other = facet(int(entry.x));
        uint hidden = 0u;
        for (int i = 0; i < TOGETHER; i++) {
            ray.source = source(min(first + i * step, u_count - 1), disc);
            aim(ray);
            vec3 area = turns(across(ray, other.a), across(ray, other.b), across(ray, other.c));
            bool hit = met(area) && behind(ray, other);
#if GLS_MASKED
            hit = hit && (entry.z == 0u || solid(int(entry.z) - 1, area));
#endif
            hidden |= hit ? 1u << uint(i) : 0u;
        }
        open &= ~hidden;
        link = open == 0u ? 0u : entry.y;
    }
    return bitCount(open);
}
