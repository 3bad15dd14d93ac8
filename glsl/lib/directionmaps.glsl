// Light of many directions that reaches a surface point: the sum over directions of Lambert's cosine, and that of those whose depth map
// does not hold a nearer caster. Nearest texel; the receiver's plane is evaluated at the texel's centre.
// GLS_DIRECTIONS: directions that one pixel samples. GLS_SETS 4, 16: each pixel of a block of 2 x 2 or 4 x 4 samples another set.
// GLS_NEAR: triangles near the receiver are tested by rays. Twin: glshadow.derive.direction_maps. Needs lib/smooth_point.glsl if GLS_ROUNDED
#ifndef GLS_DIRECTIONS
#define GLS_DIRECTIONS 0
#endif
#ifndef GLS_SETS
#define GLS_SETS 1
#endif
#ifndef GLS_NEAR
#define GLS_NEAR 0 // 1: with lib/nearcasters.glsl
#endif
#ifndef GLS_WEIGHED
#define GLS_WEIGHED 0
#endif
#ifndef GLS_ROUNDED
#define GLS_ROUNDED 0
#endif
#ifndef GLS_BITS
#define GLS_BITS 0 // 1: the maps hold the bits of float depths
#endif
#if GLS_WEIGHED == 2
#define GLS_DIRECTION_ROWS 4
#define DIRECTION_SUM vec3
#else
#define GLS_DIRECTION_ROWS 3
#define DIRECTION_SUM float
#endif
uniform samplerBuffer u_directions; // rows of each direction, see glshadow.derive.direction_maps.rows_of
#if GLS_BITS
uniform usampler2D u_maps;
#else
uniform sampler2D u_maps;
#endif
uniform vec4 u_ball; // holds all casters: middle, radius
uniform vec3 u_direction_slack; // slope of a neighbouring facet, largest distance of a texel's centre and largest slack in texels
uniform vec2 u_direction_map; // last texel of a tile; rounding, world units
#if GLS_NEAR
#include "lib/nearcasters.glsl"
#endif
const int TOGETHER = 32; // directions: bits of a mask

struct DirectionSums {
    DIRECTION_SUM seen;
    DIRECTION_SUM all;
};

// position: on its triangle, where it may block no ray; normal: of the plane; lit_normal: for Lambert's law; lift: to the smooth surface
DirectionSums sum_directions(ivec2 pixel, vec3 position, vec3 normal, vec3 lit_normal, vec3 lift, bool darkened, bool any_) {
    DirectionSums sums = DirectionSums(DIRECTION_SUM(0.0), DIRECTION_SUM(0.0));
#if GLS_SETS == 16
    ivec2 odd = pixel & 1, second = pixel >> 1 & 1; // Bayer's order: any 2 x 2 pixels have sets that are four apart
    int set_ = 4 * (2 * (odd.x ^ odd.y) + odd.y) + 2 * (second.x ^ second.y) + second.y;
#elif GLS_SETS == 4
    int set_ = (pixel.x & 1) + 2 * (pixel.y & 1);
#else
    const int set_ = 0;
#endif
    int row = GLS_DIRECTION_ROWS * GLS_DIRECTIONS * set_;
    vec3 start = position - u_ball.xyz;
    int count = any_ ? GLS_DIRECTIONS : 0; // a loop, since llvmpipe skips no `if`
    vec3 looked_up = start;
#if GLS_NEAR
    uvec2 list = any_ ? near_list(start) : uvec2(0u);
    for (int done = 0; done < count; done += TOGETHER) {
    int part = min(count - done, TOGETHER);
    vec3 moved = vec3(0.0);
    uint blocked = near_blocked(list, start, normal, row / GLS_DIRECTION_ROWS, part, moved);
    looked_up = start + moved;
    float known = is_complete(list) ? u_near_reach.z - length(moved) : 0.0;
#else
    const uint blocked = 0u;
    int part = count;
#endif
    for (int i = 0; i < part; i++) {
        vec4 right = texelFetch(u_directions, row), up = texelFetch(u_directions, row + 1), texel = texelFetch(u_directions, row + 2);
        vec3 towards = cross(right.xyz, up.xyz);
        float cosine = dot(lit_normal, towards);
        vec3 from = looked_up;
#if GLS_ROUNDED
        float face = dot(normal, towards);
        from += lift * clamp(1.0 - face / SMOOTH_FADE, 0.0, 1.0);
        vec3 plane = face <= 0.0 && lift != vec3(0.0) ? lit_normal + max(0.01 - cosine, 0.0) * towards : normal;
        vec3 leaning = vec3(dot(right.xyz, plane), dot(up.xyz, plane), dot(towards, plane));
        bool faces = min(cosine, leaning.z) > 0.0;
#else
        vec3 leaning = vec3(dot(right.xyz, normal), dot(up.xyz, normal), cosine);
        bool faces = cosine > 0.0;
#endif
        vec2 place = vec2(dot(right.xyz, from), dot(up.xyz, from)) / texel.xy + vec2(right.w, up.w);
        vec2 at = clamp(floor(place), vec2(0.0), vec2(u_direction_map.x)); // beyond the tile: its border, which holds no caster
        vec2 aside = (at + 0.5 - place) * texel.xy;
        float slope = 1.0 / max(leaning.z, 1e-4);
        float tilt = sqrt(max(1.0 - leaning.z * leaning.z, 0.0)) * slope;
        float facet = u_direction_slack.x * (1.0 + tilt * tilt) / max(1.0 - u_direction_slack.x * tilt, 1e-3);
        float slack = max(texel.x, texel.y) * min(u_direction_slack.y * facet, u_direction_slack.z) + u_direction_map.y;
        float rise = dot(leaning.xy, aside) * slope;
#if GLS_NEAR
        slack = max(slack, known - sqrt(dot(aside, aside) + rise * rise)); // nearer casters are tested by rays
#endif
        float depth = rise - dot(towards, from) - slack;
#if GLS_BITS
        float stored = uintBitsToFloat(texelFetch(u_maps, ivec2(at + texel.zw), 0).r);
#else
        float stored = texelFetch(u_maps, ivec2(at + texel.zw), 0).r;
#endif
        bool lit = faces && (blocked >> uint(i & 31) & 1u) == 0u && (2.0 * stored - 1.0) * u_ball.w >= min(depth, u_ball.w);
#if GLS_WEIGHED == 2
        vec3 weight = max(cosine, 0.0) * texelFetch(u_directions, row + 3).rgb;
#else
        float weight = max(cosine, 0.0);
#endif
        sums.all += weight;
        sums.seen += lit || !darkened && faces ? weight : DIRECTION_SUM(0.0);
        row += GLS_DIRECTION_ROWS;
    }
#if GLS_NEAR
    }
#endif
    return sums;
}
