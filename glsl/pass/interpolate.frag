// Counts of an area light's visible sample points, interpolated between pixels where they are known. Image: known at every second pixel of
// each second row. GLS_PER_SAMPLE, samples of collected pixels: known at all pixels. A pixel is used if it lies on the same surface; weights
// are bilinear. Where no such pixel is around, or those around differ much, the texel is listed: it is counted on its own.
// Joint bilateral upsampling: Kopf, Cohen, Lischinski, Uyttendaele 2007, SIGGRAPH.
#ifndef GLS_ORTHO
#define GLS_ORTHO 0
#endif
#ifndef GLS_PER_SAMPLE
#define GLS_PER_SAMPLE 0
#endif
#include "lib/camera_rays.glsl"
#if GLS_PER_SAMPLE
#include "lib/per_sample.glsl"
#include "lib/sample_ray.glsl"
uniform usampler2D u_surface; // every sample
#else
layout(early_fragment_tests) in;
#endif
#include "lib/surface_number.glsl"
uniform usampler2D u_around; // the surface of each pixel
uniform usampler2D u_known; // counts: of every second pixel, or of each
uniform samplerBuffer u_planes; // per drawn triangle: unit world normal, distance from the scene's origin
uniform ivec2 u_units; // of a known count over an interpolated one; the latter of a whole light
uniform float u_pixel; // height of a pixel, for each unit of view depth
uniform vec2 u_shown; // place in a pixel of what it shows
flat in vec3 v_forward_l;
layout(std430, binding = 0) buffer Counter { uint listed_count; };
layout(std430, binding = 1) writeonly buffer Texels { uint texels[]; }; // x | y << 16
layout(std430, binding = 2) writeonly buffer Places { uint places[]; }; // where the count belongs
layout(location = 0) out uint o_seen;
const float SAME_NORMAL = 0.97; // normals farther apart than 14 degrees are of different surfaces
const float LEAST_WEIGHT = GLS_PER_SAMPLE == 1 ? 0.5 : 0.75; // of pixels on the same surface
const float MOST_CHANGE = 0.25; // of visibility, between pixels that are used together

void main() {
    ivec2 fragment = ivec2(gl_FragCoord.xy);
#if GLS_PER_SAMPLE
    ivec2 texel = sample_texel(fragment);
    vec3 eye, ray;
    sample_ray(texel, v_forward_l, eye, ray);
    uint own = texelFetch(u_surface, texel, 0).r;
    vec2 at = (vec2(texel) + 0.5) * (vec2(textureSize(u_around, 0)) / vec2(textureSize(u_surface, 0))) - u_shown; // pixels
    const int STEP = 1;
    ivec2 last = textureSize(u_known, 0) - 1;
#else
    ivec2 texel = fragment;
    vec3 eye = v_eye_l, ray = v_ray_l;
    uint own = texelFetch(u_around, texel, 0).r;
    vec2 at = 0.5 * vec2(texel);
    const int STEP = 2;
    ivec2 last = textureSize(u_known, 0) - 1;
#endif
    bool seen = triangle_of(own) >= 0; // else background
    vec4 plane = texelFetch(u_planes, max(triangle_of(own), 0));
    float depth = (plane.w - dot(plane.xyz, eye)) / dot(plane.xyz, ray);
    vec3 position = eye + ray * depth; // in world axes
#if GLS_ORTHO
    float near = u_pixel;
#else
    float near = u_pixel * abs(depth);
#endif
    near *= float(STEP);
    ivec2 low = ivec2(floor(at));
    vec2 across = at - vec2(low);
    float sum = 0.0, whole = 0.0, least = 1e9, most = -1e9;
    for (int i = 0; i < 4; i++) {
        ivec2 side = ivec2(i & 1, i >> 1), known = clamp(low + side, ivec2(0), last);
        vec2 share = mix(1.0 - across, across, vec2(side));
        uint there = texelFetch(u_around, STEP * known, 0).r;
        vec4 other = texelFetch(u_planes, max(triangle_of(there), 0));
        bool level = abs(dot(other.xyz, plane.xyz)) > SAME_NORMAL && abs(dot(other.xyz, position) - other.w) <= near;
        bool same = there == own || triangle_of(there) >= 0 && level && ((there ^ own) & MARKS) == 0u;
        float weight = same ? share.x * share.y : 0.0;
        float count = float(texelFetch(u_known, known, 0).r & 0x7fffffffu);
        sum += weight * count;
        whole += weight;
        least = weight > 0.0 ? min(least, count) : least;
        most = weight > 0.0 ? max(most, count) : most;
    }
    float scale = float(u_units.x);
    bool smooth_ = whole >= LEAST_WEIGHT && scale * (most - least) <= MOST_CHANGE * float(u_units.y);
    o_seen = seen && smooth_ ? uint(scale * sum / whole + 0.5) : 0u;
    int wanted = seen && !smooth_ ? 1 : 0;
    for (int i = 0; i < wanted; i++) { // not an if: llvmpipe would execute the atomics for every pixel
        uint number = atomicAdd(listed_count, 1u);
        texels[number] = uint(texel.x) | uint(texel.y) << 16u;
        places[number] = uint(fragment.x) | uint(fragment.y) << 16u;
    }
}
