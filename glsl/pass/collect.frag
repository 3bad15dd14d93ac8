// Collects the pixels whose samples may differ: those that see several surfaces (pass/fill.frag), and those whose samples may see the light
// differently. GLS_MARKED: the latter are marked already. GLS_NEIGHBORS: also those with a neighbour of another visibility; GLS_MARKED without
// it: only if neither of the two is marked or sees several surfaces. Drawn for each light over all surfaces; no pixel is collected twice, and
// the requests of each light are kept.
#ifndef GLS_MARKED
#define GLS_MARKED 0
#endif
#ifndef GLS_NEIGHBORS
#define GLS_NEIGHBORS 1
#endif
#ifndef GLS_EVERY
#define GLS_EVERY 0 // 1: all pixels with a surface
#endif
#ifndef GLS_FIRST
#define GLS_FIRST 1 // 1: the first light
#endif
#include "lib/sample_requests.glsl"
#include "lib/mixed.glsl"
layout(early_fragment_tests) in;
layout(std430, binding = 0) buffer Collected { uint collected_count; };
layout(std430, binding = 1) writeonly buffer Pixels { uint pixels[]; }; // x, y << 16
layout(r32ui, binding = 0) uniform uimage2D u_requests; // see lib/sample_requests.glsl; 0 before the first light
uniform usampler2D u_mixed;
uniform sampler2D u_visibility; // NaN where there is no surface; 2 more: marked
uniform int u_light;
const float DIFFERS = 0.3; // of visibility; in a penumbra wider than three pixels the centre's value is the mean
const ivec2 NEIGHBOR[4] = ivec2[4](ivec2(-1, 0), ivec2(0, -1), ivec2(0, 1), ivec2(1, 0));

vec4 unmarked(vec4 visibility) {
    return visibility - (GLS_MARKED == 1 ? 2.0 * step(1.5, visibility) : vec4(0.0));
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    bool differs = GLS_EVERY == 1;
#if GLS_MARKED
    differs = differs || texelFetch(u_visibility, pixel, 0).r >= 1.5;
#endif
    bool mixed = texelFetch(u_mixed, pixel, 0).r == MIXED;
#if GLS_NEIGHBORS || GLS_MARKED
    vec2 texel = 1.0 / vec2(textureSize(u_visibility, 0));
    // four pixels at a time, around a corner of this one; clamped at the border of the image
    vec4 below = textureGather(u_visibility, vec2(pixel) * texel), above = textureGather(u_visibility, vec2(pixel + 1) * texel);
    vec4 others = vec4(below.x, below.z, above.x, above.z); // left, down, up, right
#if GLS_NEIGHBORS
    differs = differs || any(greaterThan(abs(unmarked(others) - unmarked(below).y), vec4(DIFFERS))); // false for NaN
#else
    // Where two surfaces cross, a shadow begins, but not at a silhouette edge, and samples may see only one of them.
    vec4 change = abs(others - below.y) * step(others, vec4(1.5)); // 0 to marked pixels
    int tests = !differs && !mixed && any(greaterThan(change, vec4(DIFFERS))) ? 4 : 0;
    for (int i = 0; i < tests; i++) {
        differs = differs || change[i] > DIFFERS && texelFetch(u_mixed, pixel + NEIGHBOR[i], 0).r != MIXED;
    }
#endif
#endif
    int height = textureSize(u_visibility, 0).y;
    ivec2 word = request_at(pixel, u_light, height);
#if GLS_FIRST
    const uint before = 0u;
    bool collects = differs || mixed;
#else
    bool next = u_light % LIGHTS_PER_WORD == 0; // first bit of a word
    uint before = imageLoad(u_requests, next ? word - ivec2(0, height) : word).r;
    before = next ? (before != 0u ? 0x80000000u : 0u) : before;
    bool collects = differs && !mixed && before == 0u;
#endif
    int turns = collects ? 1 : 0;
    for (int i = 0; i < turns; i++) { // not an if: llvmpipe would execute the atomics for every pixel
        pixels[atomicAdd(collected_count, 1u)] = uint(pixel.x) | uint(pixel.y) << 16u;
    }
    uint requests = before | (differs ? request_bit(u_light) : 0u);
    turns = requests != 0u ? 1 : 0;
    for (int i = 0; i < turns; i++) imageStore(u_requests, word, uvec4(requests));
}
