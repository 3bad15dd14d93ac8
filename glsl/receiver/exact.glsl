// Slot <shadow>: exact. A receiver is dark iff a triangle other than its own lies between it and the light: no map, no bias, no texels.
//
// Watertight: each vertex is projected along the ray first, then the edges' signs are taken in 2D (Woop, Benthin, Wald 2013, section 3).
// The projected vertex depends on its position and the ray only, so that for each ray the mesh stays closed, with slightly moved vertices.
// The difference of two rounded products (no fma: GLS_PRECISE) has the exact sign or is 0, which counts for both sides of an edge. So no
// ray can slip between neighbours.
//
// No self-shadowing: the receiver's own triangle is skipped by its number. Another triangle counts only if the receiver's distance to its
// plane exceeds the rounding of that distance, u_bound. The distance to the occluder's plane, not along the ray, does not grow at grazing
// light. Twin and derivation: glshadow.derive.lists.distance_bound
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_POINT
#define GLS_POINT 0
#endif
#ifndef GLS_CELLS
#define GLS_CELLS 512 // along a side of the grid
#endif
#ifndef GLS_AREA
#define GLS_AREA 0 // 1: rays go to a sample point of the light instead of its centre
#endif
#ifndef GLS_HUGE
#define GLS_HUGE 0 // 1: some triangles are so long that they need their own bound
#endif
#ifndef GLS_CAPSULES
#define GLS_CAPSULES 0 // 1: the scene has balls; 2: also tubes
#endif
#ifndef GLS_MARKS
#define GLS_MARKS 0 // 1: also computes whether the samples of a pixel may see the light differently
#endif
#ifndef GLS_POINTS
#define GLS_POINTS 0 // 1, 2: receivers are given as points, see lib/given_point.glsl
#endif
#if GLS_POINT || GLS_AREA && !GLS_AT_INFINITY
#include "lib/faces.glsl"
#endif
#include "lib/facet.glsl"
uniform vec4 u_cells; // cell of the lists = xy (directional light) or tangent * u_cells.xy + u_cells.zw
uniform vec2 u_bound; // world units; share of the distances to the planes' reference corners
#if GLS_HUGE || GLS_POINTS
uniform vec2 u_huge; // largest coordinate that u_bound covers; growth with a vertex's excess over it
#endif
const float GRAZING = 0.01; // cosine below which rounding may move a surface's self-shadow boundary by more than a pixel
#if GLS_CAPSULES
bool receiver_round; // the receiver is on a capsule, see lib/capsule.glsl
#endif
int receiver_triangle; // must be set before light_visibility; -1: the receiver is on no triangle
vec3 receiver_corner; // a corner of it, in the light's frame
vec3 receiver_face; // normal of the receiver's horizon, for area lights

struct Ray { // from a receiver to the light
    vec3 position; // in the light's frame
#if GLS_AREA
    vec3 source; // directional light: (x, y, 1) along the ray; else the position of the light's sample point
#endif
#if GLS_POINT || GLS_AREA && !GLS_AT_INFINITY
    vec3 right; // two vectors perpendicular to the ray: both dot products are 0 on the ray
    vec3 up;
#elif !GLS_AT_INFINITY
    vec2 tangent;
#endif
    float bound;
};

vec2 across(Ray ray, vec3 v) { // a vertex projected along the ray; the ray is the origin
#if GLS_AREA && GLS_AT_INFINITY
    GLS_PRECISE vec2 seen = v.xy - ray.position.xy - ray.source.xy * (v.z - ray.position.z);
#elif GLS_AREA
    GLS_PRECISE vec3 w = v - ray.source;
    GLS_PRECISE vec2 seen = vec2(w.x * ray.right.x + w.y * ray.right.y + w.z * ray.right.z, w.x * ray.up.x + w.y * ray.up.y + w.z * ray.up.z);
#elif GLS_AT_INFINITY
    GLS_PRECISE vec2 seen = v.xy - ray.position.xy;
#elif GLS_POINT
    GLS_PRECISE vec2 seen = vec2(v.x * ray.right.x + v.y * ray.right.y + v.z * ray.right.z, v.x * ray.up.x + v.y * ray.up.y + v.z * ray.up.z);
#else
    GLS_PRECISE vec2 seen = v.xy + ray.tangent * v.z;
#endif
    return seen;
}

vec3 turns(vec2 a, vec2 b, vec2 c) { // twice the areas of the triangles between the ray and the edges: c's share, a's, b's
    GLS_PRECISE vec3 area = vec3(a.x * b.y, b.x * c.y, c.x * a.y) - vec3(a.y * b.x, b.y * c.x, c.y * a.x);
    return area;
}

bool met(vec3 area) { // all of one sign, or 0 on an edge
    return !(min(area.x, min(area.y, area.z)) < 0.0 && max(area.x, max(area.y, area.z)) > 0.0);
}

// Whether the receiver is behind the other's plane, seen from the light: 1: behind, 0: not, -1: closer to the plane than rounding allows.
int behind(Ray ray, Facet other) {
    vec3 offset = ray.position - other.a;
    float gap = dot(other.normal, offset);
#if GLS_AREA && GLS_AT_INFINITY
    float side = -dot(other.normal, ray.source);
#elif GLS_AT_INFINITY
    float side = -other.normal.z;
#else
#if GLS_AREA
    float side = dot(other.normal, other.a - ray.source);
#else
    float side = dot(other.normal, other.a);
#endif
    if (abs(side) <= u_bound.x) return 0; // the light is in the plane: neither side is behind
#endif
    float bound = ray.bound + u_bound.y * dot(abs(offset), vec3(1.0));
#if GLS_HUGE
    vec3 reach = max(abs(other.a), max(abs(other.b), abs(other.c)));
    bound += u_huge.y * max(max(reach.x, max(reach.y, reach.z)) - u_huge.x, 0.0);
#endif
    gap = side < 0.0 ? -gap : gap;
    return gap > bound ? 1 : gap < -bound ? 0 : -1;
}

float receiver_bound(vec3 position_lv) { // apparent distance of the receiver from a plane that it lies in
    float bound = u_bound.x + (GLS_HUGE == 1 ? 3.0 : 1.0) * u_bound.y * dot(abs(position_lv - receiver_corner), vec3(1.0));
#if GLS_POINTS // they may be far outside of what u_bound covers
    vec3 reach = abs(position_lv);
    bound += u_huge.y * max(max(reach.x, max(reach.y, reach.z)) - u_huge.x, 0.0);
#endif
    return bound;
}

// If two triangles share an edge and lie on the same side of it, seen from the light, one is wholly in front of the other: returns whether
// the other is in front of the receiver's own. Decided by the corners off the edge, which is more reliable than distances near it.
bool folds_before(Facet own, Facet other) {
    bvec3 joint = bvec3(other.a == own.a || other.a == own.b || other.a == own.c, other.b == own.a || other.b == own.b || other.b == own.c,
                         other.c == own.a || other.c == own.b || other.c == own.c);
    if (int(joint.x) + int(joint.y) + int(joint.z) != 2) return false;
    vec3 p = joint.x ? other.a : other.b, q = joint.z ? other.c : other.b; // the edge
    vec3 theirs = joint.x ? joint.y ? other.c : other.b : other.a; // corners off it
    vec3 mine = own.a != p && own.a != q ? own.a : own.b != p && own.b != q ? own.b : own.c;
#if GLS_AT_INFINITY
    float one = (q.x - p.x) * (mine.y - p.y) - (q.y - p.y) * (mine.x - p.x);
    float two = (q.x - p.x) * (theirs.y - p.y) - (q.y - p.y) * (theirs.x - p.x);
    float side = own.normal.z;
#else
    float one = dot(cross(p, q), mine), two = dot(cross(p, q), theirs);
    float side = -dot(own.normal, own.a);
#endif
    vec3 offset = theirs - own.a;
    float height = dot(own.normal, offset) * (side < 0.0 ? -1.0 : 1.0);
    return one * two > 0.0 && height > u_bound.x + u_bound.y * dot(abs(offset), vec3(1.0));
}

#include <candidates>

#if !GLS_AREA
#if GLS_MARKS
#include "exact/edges.glsl"

bool samples_differ(PixelFootprint pixel, float cosine, float lit) {
#if GLS_CAPSULES
    if (capsules_in(pixel)) return true;
#endif
    return edge_in(pixel, cosine > 0.0);
}
#endif

float light_visibility(vec3 position_lv, vec3 normal_lv, float cosine) {
    Ray ray;
    ray.bound = receiver_bound(position_lv);
#if GLS_AT_INFINITY
    const bool faces = true;
#else
    bool faces = abs(dot(normal_lv, position_lv)) > ray.bound; // else the light, at the origin, is in the plane: rounding would decide
#endif
    position_lv += normal_lv * (cosine < GRAZING ? ray.bound : 0.0); // above its neighbourhood as moved by rounding
    ray.position = position_lv;
    float face = 0.0, depth = -position_lv.z;
    vec2 place = position_lv.xy;
#if GLS_POINT
    float axis = face_axis(position_lv), s = face_side(position_lv, axis);
    face = face_number(axis, s);
    vec3 right = face_right(axis, s), up = face_up(axis, s), backward = face_backward(axis, s);
    depth = -dot(backward, position_lv);
    place = vec2(dot(right, position_lv), dot(up, position_lv)) / max(depth, 1e-30);
    ray.right = right + place.x * backward;
    ray.up = up + place.y * backward;
#elif !GLS_AT_INFINITY
    place /= max(depth, 1e-30);
    ray.tangent = place;
#endif
    vec2 cell = place * u_cells.xy + u_cells.zw;
    bool inside = all(greaterThanEqual(cell, vec2(0.0))) && all(lessThan(cell, vec2(GLS_CELLS)));
#if GLS_POINT
    inside = true; // by choice of the face; at its border rounding may give a cell past the last
#elif !GLS_AT_INFINITY
    inside = inside && depth > 0.0;
#endif
    return faces && !blocked(ray, cell, face, depth, inside && cosine > 0.0) ? 1.0 : 0.0;
}
#endif
