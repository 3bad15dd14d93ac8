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
#include "lib/sight.glsl"
#include "lib/surface_number.glsl"
uniform usampler2D u_surface; // as GL drew it
uniform sampler2D u_camera_depth;
uniform usamplerBuffer u_corners; // per triangle: vertices, node
uniform samplerBuffer u_positions; // world axes, relative to the scene's origin
uniform usamplerBuffer u_neighbours; // per triangle: across its edges ab, bc, ca; see glshadow.core.adjacency
uniform vec3 u_right_l; // how rays, or GLS_ORTHO their starts, change from pixel to pixel; here axes are the world's
uniform vec3 u_up_l;
uniform float u_near; // in the unit
uniform float u_unit; // what world units are multiplied by, so that products neither overflow nor vanish; a power of two
flat in vec2 v_unproject;
const uint NONE = 0xffffffffu, TURNED = 0x80000000u;
const int STEPS = 16; // of a walk
const float STEEP = 1.0; // depth from pixel to pixel over a pixel's size: with more, another surface may lie before this one
const float SAME_DEPTH = 1e-5; // relative; layers that are nearer to each other are in the order in which GL drew them
const float NEAR_EDGE = 1.0 / 64.0; // pixels: across an edge so near the neighbour is tried as well, which may be folded over it
#if GLS_SURFACE == 1
layout(location = 0) out uint o_surface;
#elif GLS_SURFACE == 2
layout(location = 0) out uvec2 o_surface;
#else
layout(location = 0) out uvec4 o_surface;
#endif

vec3 from_eye(uint vertex) {
    return (texelFetch(u_positions, int(vertex)).xyz - v_eye_l) * u_unit;
}

float depth_at(ivec2 pixel) {
    float depth = v_unproject.x + v_unproject.y * texelFetch(u_camera_depth, pixel, 0).r;
#if GLS_ORTHO
    return depth;
#else
    return 1.0 / depth;
#endif
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(u_surface, 0) - 1;
    uvec4 own = texelFetch(u_surface, pixel, 0);
    uint drawn = own.r & TRIANGLE_BITS;
    // An edge so near to the pixel's middle leaves one of its four neighbours to another triangle.
    ivec2 low = max(pixel - 1, ivec2(0)), high = min(pixel + 1, last);
    ivec2 around[4] = ivec2[4](ivec2(low.x, pixel.y), ivec2(high.x, pixel.y), ivec2(pixel.x, low.y), ivec2(pixel.x, high.y));
    bool uneven = any(equal(pixel, ivec2(0))) || any(equal(pixel, last));
    for (int i = 0; i < 4; i++) uneven = uneven || (texelFetch(u_surface, around[i], 0).r & TRIANGLE_BITS) != drawn;

    vec3 ray = v_ray_l;
    // two vectors across the ray: a vertex seen along them depends on nothing but its place, so that neighbours agree
    vec3 right = u_right_l - ray * (dot(u_right_l, ray) / dot(ray, ray)), up = u_up_l - ray * (dot(u_up_l, ray) / dot(ray, ray));
    float pixel_size = dot(right, right); // of points seen along these vectors, at depth 1
    int start = 9;
    bool steep = false;
    int looks = uneven ? 1 : 0; // loops: llvmpipe skips nothing else
    for (int i = 0; i < looks; i++) {
        float depth = depth_at(pixel), nearest = depth;
        for (int k = 0; k < 4; k++) nearest = min(nearest, depth_at(around[k]));
#if GLS_ORTHO
        float size = length(u_right_l);
#else
        float size = length(u_right_l) * nearest;
#endif
        steep = depth - nearest > STEEP * size;
        start = 0;
    }
    int triangle = -1, came_from = -1, left = 0, found = -1;
    uint node = 0u;
    uvec4 texel = own, shown = own;
    vec3 before = vec3(0.0), before_corner = vec3(0.0); // plane of the last triangle, turned to the eye
    float nearest = 1e38;
    while (start < 9 || left > 0) {
        bool begins = left == 0;
        int k = start == 0 ? 4 : start <= 4 ? start - 1 : start; // own pixel first
        uvec4 there = texelFetch(u_surface, clamp(pixel + ivec2(k % 3 - 1, k / 3 - 1), ivec2(0), last), 0);
        texel = begins ? there : texel;
        int other = int(there.r & TRIANGLE_BITS) - 1;
        bool first = begins && start == 0;
        triangle = begins ? other : triangle;
        came_from = begins ? -1 : came_from;
        shown = begins && found >= 0 && other == found ? there : shown; // its normal and colour
        // the own triangle has been tried; what a texture cuts out is taken where it was drawn alone
        bool tries = triangle >= 0 && (first || !begins || int(drawn) - 1 != other && !is_cut_out(there.r));
        left = begins ? (tries ? STEPS : 0) : left;
        start += begins ? 1 : 0;
        uvec4 corners = texelFetch(u_corners, max(triangle, 0));
        node = begins ? corners.w : node;
        vec3 a = from_eye(corners.x), b = from_eye(corners.y), c = from_eye(corners.z);
        GLS_PRECISE vec2 p = vec2(a.x * right.x + a.y * right.y + a.z * right.z, a.x * up.x + a.y * up.y + a.z * up.z);
        GLS_PRECISE vec2 q = vec2(b.x * right.x + b.y * right.y + b.z * right.z, b.x * up.x + b.y * up.y + b.z * up.z);
        GLS_PRECISE vec2 r = vec2(c.x * right.x + c.y * right.y + c.z * right.z, c.x * up.x + c.y * up.y + c.z * up.z);
        GLS_PRECISE vec3 area = vec3(p.x * q.y, q.x * r.y, r.x * p.y) - vec3(p.y * q.x, q.y * r.x, r.y * p.x);
        bool met = !(min(area.x, min(area.y, area.z)) < 0.0 && max(area.x, max(area.y, area.z)) > 0.0);
        vec3 normal = cross(b - a, c - a);
        float slant = dot(normal, ray), along = dot(normal, a) / (slant == 0.0 ? 1.0 : slant);
        met = met && slant != 0.0 && along >= u_near && corners.w == node && left > 0;
        // what hangs together by an edge lies before or behind as a whole: the corner off that edge tells, more surely than depths near it
        vec3 heights = vec3(dot(before, a - before_corner), dot(before, b - before_corner), dot(before, c - before_corner));
        float off = max(heights.x, max(heights.y, heights.z)), under = min(heights.x, min(heights.y, heights.z));
        bool hangs = found >= 0 && found == came_from;
        bool nearer = met && (hangs ? off > -under : along < nearest * (1.0 - SAME_DEPTH));
        found = nearer ? triangle : found;
        shown = nearer ? texel : shown;
        nearest = nearer ? along : nearest;
        // over the edge behind which the ray lies farthest
        vec3 beyond = area * (area.x + area.y + area.z < 0.0 ? 1.0 : -1.0)
            * inversesqrt(max(vec3(dot(q - p, q - p), dot(r - q, r - q), dot(p - r, p - r)), 1e-37));
        uvec3 neighbours = texelFetch(u_neighbours, max(triangle, 0)).xyz;
        vec3 open = mix(beyond, vec3(-1e38), equal(neighbours & ~TURNED, uvec3(came_from))); // not back
        int edge = open.x >= open.y && open.x >= open.z ? 0 : open.y >= open.z ? 1 : 2;
        int across = neighbours[edge] == NONE ? -1 : int(neighbours[edge] & ~TURNED);
        float border = max(beyond.x, max(beyond.y, beyond.z));
#if GLS_ORTHO
        bool done = met && border < -NEAR_EDGE * pixel_size * u_unit;
#else
        bool done = met && border < -NEAR_EDGE * pixel_size * along;
#endif
        before = normal * (slant > 0.0 ? -1.0 : 1.0);
        before_corner = a;
        left = done || across < 0 || corners.w != node ? 0 : left - 1;
        came_from = triangle;
        triangle = left > 0 ? across : triangle;
        start = first && met && !steep ? 9 : start; // met where it was drawn, and nothing can be before it
    }
    uvec4 result = own;
    if (uneven && found < 0) result.r |= MISSED;
    if (found >= 0 && found != int(drawn) - 1) result = uvec4((shown.r & ~TRIANGLE_BITS) | uint(found + 1) | MOVED, shown.gba);
#if GLS_SURFACE == 1
    o_surface = result.r;
#elif GLS_SURFACE == 2
    o_surface = result.rg;
#else
    o_surface = result;
#endif
}
