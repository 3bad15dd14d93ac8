// Slot <between>: whether any silhouette edge lies between a receiver and some part of an area light. Needs lib/cone.glsl.
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_MASKED
#define GLS_MASKED 0
#endif
#include "exact/grown.glsl"

float beside(vec3 a, vec3 b) { // squared distance of an edge from the cone's axis at height 1; z is height
    float most = max(a.z, b.z), low = 1e-4 * most;
    vec3 p = a.z < low ? mix(a, b, (low - a.z) / (b.z - a.z)) : a, q = b.z < low ? mix(b, a, (low - b.z) / (a.z - b.z)) : b;
    vec2 from = p.xy / p.z, along = q.xy / q.z - from;
    vec2 nearest = from + along * clamp(-dot(from, along) / max(dot(along, along), 1e-30), 0.0, 1.0);
    return most > 0.0 ? dot(nearest, nearest) : 1e38;
}

bool is_cut(vec3 position) { // whether a silhouette edge is in the cone
#if !GLS_AT_INFINITY
    mat3 axes = cone_axes(position);
#endif
    Place place = place_of(position);
    uint link = head_at(place);
    bool cut = false;
    float reach2 = u_radius * u_radius * 1.0002;
    while (link != 0u) {
        uvec4 entry = texelFetch(u_grown_links, int(link) - 1);
        link = entry.y;
        if (uintBitsToFloat(entry.z) > place.depth) continue;
        int item = 3 * int(entry.x), edge = int(entry.w) % 3;
        vec3 a = TO_CONE(axes, texelFetch(u_facets, item + edge).xyz - position);
        vec3 b = TO_CONE(axes, texelFetch(u_facets, item + (edge + 1) % 3).xyz - position);
        float gap = beside(a, b);
#if GLS_MASKED || !GLS_AT_INFINITY
        if (entry.w == 3u) { // a triangle
            vec3 c = TO_CONE(axes, texelFetch(u_facets, item + 2).xyz - position);
            gap = min(gap, min(beside(b, c), beside(c, a)));
            vec3 area = vec3(a.x * b.y - a.y * b.x, b.x * c.y - b.y * c.x, c.x * a.y - c.y * a.x);
            gap = max(a.z, max(b.z, c.z)) > 0.0 && met(area) ? 0.0 : gap;
        }
#endif
        if (gap <= reach2) {
            cut = true;
            link = 0u;
        }
    }
    return cut;
}
