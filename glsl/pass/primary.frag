// The triangle that each pixel's ray meets first. GL snaps vertices to 1/256 pixel, so that beside an edge it may draw the neighbour of the
// triangle that the ray through the pixel's middle meets. From the drawn triangle, and where that fails or a silhouette is near from those
// of the eight pixels around, a walk leads over the edges that lie between a triangle and the ray; of the triangles that the ray meets the
// nearest is taken. Needs a surface buffer, and the scene's triangles with their neighbours.
#ifndef GLS_SURFACE
#define GLS_SURFACE 1
#endif
#ifndef GLS_ORTHO
#define GLS_ORTHO 0
#endif
#ifndef GLS_SILHOUETTES
#define GLS_SILHOUETTES 1 // 0: does not look for what lies before a triangle that the ray meets: of one of several samples nobody sees it
#endif
#include "lib/sight.glsl"
#include "lib/surface_number.glsl"
uniform usampler2D u_surface; // as GL drew it
uniform sampler2D u_camera_depth;
uniform usamplerBuffer u_corners; // per triangle: vertices, node
uniform samplerBuffer u_positions; // world axes, relative to the scene's origin
uniform usamplerBuffer u_neighbours; // per triangle: across its edges ab, bc, ca; see glshadow.geometry.adjacency
uniform vec3 u_right_l; // how rays, or GLS_ORTHO their starts, change from pixel to pixel; here axes are the world's
uniform vec3 u_up_l;
uniform float u_near; // in the unit
uniform float u_unit; // what world units are multiplied by, so that products neither overflow nor vanish; a power of two
flat in vec2 v_unproject;
const uint NONE = 0xffffffffu, TURNED = 0x80000000u;
const int STEPS = 8; // of a walk
const float STEEP = 4.0; // depth from pixel to pixel over a pixel's size: with more, another surface may lie before this one
const float SAME_DEPTH = 1e-5; // relative; layers that are nearer to each other are in the order in which GL drew them
const float NEAR_EDGE = 1.0 / 64.0; // pixels: across an edge so near the neighbour is tried as well, which may be folded over it
#if GLS_SURFACE == 1
layout(location = 0) out uint o_surface;
#elif GLS_SURFACE == 2
layout(location = 0) out uvec2 o_surface;
#else
layout(location = 0) out uvec4 o_surface;
#endif

#if __VERSION__ < 400
int findLSB(uint bits) { // the exponent of its lowest bit
    return int(floatBitsToUint(float(bits & (~bits + 1u))) >> 23u) - 127;
}
#endif

// What a ray from the eye makes of a triangle. Two vectors across the ray: a vertex seen along them depends on nothing but its place, so
// that neighbours agree.
struct Meeting {
    bool met;
    float along; // in units of the ray
    vec3 normal; // turned to the eye
    vec3 corner; // one of the triangle, from the eye
    vec3 heights; // of its corners over another plane, see hang
    vec3 beyond; // by how much the ray lies beyond the edges ab, bc, ca, seen along these vectors
};

vec3 from_eye(uint vertex) {
    return (texelFetch(u_positions, int(vertex)).xyz - v_eye_l) * u_unit;
}

Meeting meet(uvec4 corners, vec3 ray, vec3 right, vec3 up, vec3 hang, vec3 hang_corner) {
    Meeting m;
    vec3 a = from_eye(corners.x), b = from_eye(corners.y), c = from_eye(corners.z);
    GLS_PRECISE vec2 p = vec2(a.x * right.x + a.y * right.y + a.z * right.z, a.x * up.x + a.y * up.y + a.z * up.z);
    GLS_PRECISE vec2 q = vec2(b.x * right.x + b.y * right.y + b.z * right.z, b.x * up.x + b.y * up.y + b.z * up.z);
    GLS_PRECISE vec2 r = vec2(c.x * right.x + c.y * right.y + c.z * right.z, c.x * up.x + c.y * up.y + c.z * up.z);
    GLS_PRECISE vec3 area = vec3(p.x * q.y, q.x * r.y, r.x * p.y) - vec3(p.y * q.x, q.y * r.x, r.y * p.x);
    vec3 normal = cross(b - a, c - a);
    float slant = dot(normal, ray);
    m.along = dot(normal, a) / (slant == 0.0 ? 1.0 : slant);
    m.met = !(min(area.x, min(area.y, area.z)) < 0.0 && max(area.x, max(area.y, area.z)) > 0.0) && slant != 0.0 && m.along >= u_near;
    m.normal = slant > 0.0 ? -normal : normal;
    m.corner = a;
    m.heights = vec3(dot(hang, a - hang_corner), dot(hang, b - hang_corner), dot(hang, c - hang_corner));
    m.beyond = area * (area.x + area.y + area.z < 0.0 ? 1.0 : -1.0)
        * inversesqrt(max(vec3(dot(q - p, q - p), dot(r - q, r - q), dot(p - r, p - r)), 1e-37));
    return m;
}

#if GLS_SILHOUETTES
float depth_key(ivec2 pixel) { // 1 / depth, GLS_ORTHO: depth
    return v_unproject.x + v_unproject.y * texelFetch(u_camera_depth, clamp(pixel, ivec2(0), textureSize(u_surface, 0) - 1), 0).r;
}
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(u_surface, 0) - 1;
    uvec4 own = texelFetch(u_surface, pixel, 0);
    // An edge so near to the pixel's middle leaves one of its four neighbours to another triangle.
#if __VERSION__ >= 400
    vec2 size = vec2(last + 1);
    uvec4 below = textureGather(u_surface, vec2(pixel) / size), above = textureGather(u_surface, vec2(pixel + 1) / size);
    uvec4 beside = uvec4(below.x, below.z, above.x, above.z);
#else
    ivec2 low = max(pixel - 1, ivec2(0)), high = min(pixel + 1, last);
    uvec4 beside = uvec4(texelFetch(u_surface, ivec2(low.x, pixel.y), 0).r, texelFetch(u_surface, ivec2(pixel.x, low.y), 0).r,
                         texelFetch(u_surface, ivec2(high.x, pixel.y), 0).r, texelFetch(u_surface, ivec2(pixel.x, high.y), 0).r);
#endif
    bool uneven = any(equal(pixel, ivec2(0))) || any(equal(pixel, last)) || any(notEqual(beside, uvec4(own.r)));
    vec3 ray = v_ray_l;
    vec3 right = u_right_l - ray * (dot(u_right_l, ray) / dot(ray, ray)), up = u_up_l - ray * (dot(u_up_l, ray) / dot(ray, ray));
    float pixel_size = dot(right, right); // of points seen along these vectors, at depth 1
    const int OWN = 4; // of the nine pixels around, row after row from below
    uint starts = 0u; // those from which to walk, a bit each
    int drawn = triangle_of(own.r), found = -1;
    float nearest = 1e38;
    int looks = uneven ? 1 : 0; // loops: llvmpipe skips nothing else
    for (int i = 0; i < looks; i++) {
        Meeting m = meet(texelFetch(u_corners, max(drawn, 0)), ray, right, up, vec3(0.0), vec3(0.0));
        float border = max(m.beyond.x, max(m.beyond.y, m.beyond.z));
#if GLS_ORTHO
        bool inside = m.met && border < -NEAR_EDGE * pixel_size * u_unit;
#else
        bool inside = m.met && border < -NEAR_EDGE * pixel_size * m.along;
#endif
        starts = inside ? 0u : 1u << uint(OWN);
        found = inside ? drawn : -1;
        nearest = inside ? m.along : nearest;
#if GLS_SILHOUETTES
        float key = depth_key(pixel), step_ = STEEP * length(u_right_l);
#if GLS_ORTHO
        float limit = key - step_;
#define BEFORE(x, y) (depth_key(pixel + ivec2(x, y)) < limit)
#else
        float limit = key * (1.0 + step_);
#define BEFORE(x, y) (depth_key(pixel + ivec2(x, y)) > limit)
#endif
        starts |= (BEFORE(0, -1) ? 2u : 0u) | (BEFORE(0, 1) ? 0x80u : 0u) | (BEFORE(-1, 0) ? 8u : 0u) | (BEFORE(1, 0) ? 0x20u : 0u);
#endif
    }
    int triangle = -1, came_from = -1, left = 0;
    uint node = 0u;
    uvec4 texel = own, shown = own;
    vec3 hang = vec3(0.0), hang_corner = vec3(0.0); // plane of the last triangle, turned to the eye
    while (starts != 0u || left > 0) {
        bool begins = left == 0;
        int k = (starts & 1u << uint(OWN)) != 0u ? OWN : findLSB(starts); // own pixel first
        uvec4 there = texelFetch(u_surface, clamp(pixel + ivec2(k % 3 - 1, k / 3 - 1), ivec2(0), last), 0);
        int other = triangle_of(there.r);
        bool first = begins && k == OWN;
        texel = begins ? there : texel;
        triangle = begins ? other : triangle;
        came_from = begins ? -1 : came_from;
        shown = begins && found >= 0 && other == found ? there : shown; // its normal and colour
        // the own triangle has been tried; what a texture cuts out is taken where it was drawn alone
        left = !begins ? left : other >= 0 && (first || other != drawn && !is_cut_out(there.r)) ? STEPS : 0;
        starts = begins ? starts & ~(1u << uint(k)) : starts;
        uvec4 corners = texelFetch(u_corners, max(triangle, 0));
        node = begins ? corners.w : node;
        Meeting m = meet(corners, ray, right, up, hang, hang_corner);
        bool goes_on = left > 0 && corners.w == node;
        bool met = m.met && goes_on;
        // what hangs together by an edge lies before or behind as a whole: the corner off that edge tells, more surely than depths near it
        float over = max(m.heights.x, max(m.heights.y, m.heights.z)), under = min(m.heights.x, min(m.heights.y, m.heights.z));
        bool hangs = found >= 0 && found == came_from;
        bool nearer = met && (hangs ? over > -under : m.along < nearest * (1.0 - SAME_DEPTH));
        found = nearer ? triangle : found;
        shown = nearer ? texel : shown;
        nearest = nearer ? m.along : nearest;
        starts = first && !met ? 0x1efu : starts; // where the ray misses what was drawn, from all pixels around
        // over the edge behind which the ray lies farthest, and not back
        uvec3 neighbours = texelFetch(u_neighbours, max(triangle, 0)).xyz;
        vec3 open = mix(m.beyond, vec3(-1e38), equal(neighbours & ~TURNED, uvec3(came_from)));
        int edge = open.x >= open.y && open.x >= open.z ? 0 : open.y >= open.z ? 1 : 2;
        int across = neighbours[edge] == NONE ? -1 : int(neighbours[edge] & ~TURNED);
        float border = max(m.beyond.x, max(m.beyond.y, m.beyond.z));
#if GLS_ORTHO
        bool done = met && border < -NEAR_EDGE * pixel_size * u_unit;
#else
        bool done = met && border < -NEAR_EDGE * pixel_size * m.along;
#endif
        hang = m.normal;
        hang_corner = m.corner;
        left = done || across < 0 || !goes_on ? 0 : left - 1;
        came_from = triangle;
        triangle = left > 0 ? across : triangle;
    }
    uvec4 result = own;
    if (uneven && found < 0) result.r |= MISSED;
    if (found >= 0 && found != drawn) result = uvec4((shown.r & ~TRIANGLE_BITS) | uint(found + 1) | MOVED, shown.gba);
#if GLS_SURFACE == 1
    o_surface = result.r;
#elif GLS_SURFACE == 2
    o_surface = result.rg;
#else
    o_surface = result;
#endif
}
