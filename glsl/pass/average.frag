// Writes the mean over a collected pixel's samples, in linear light, into the image; one fragment for each collected pixel.
// GLS_OUTPUT 1: writes the mean of one light's visibility, over the samples that see a surface, only where the surface or this light
// requests it: the requests of other lights change nothing.
#ifndef GLS_OUTPUT
#define GLS_OUTPUT 0
#endif
#ifndef GLS_SUM
#define GLS_SUM 0 // also writes the linear mean
#endif
#ifndef GLS_COLUMNS
#define GLS_COLUMNS 2
#endif
#ifndef GLS_ROWS
#define GLS_ROWS 2
#endif
#ifndef GLS_TONE
#define GLS_TONE 0
#endif
#ifndef GLS_EXPOSED
#define GLS_EXPOSED 0
#endif
#include "lib/per_sample.glsl"
#include "lib/finish.glsl"
#include "lib/srgb.glsl"
#include "lib/tone.glsl"
#if GLS_OUTPUT == 1
#include "lib/sample_requests.glsl"
#include "lib/mixed.glsl"
uniform usampler2D u_mixed;
uniform usampler2D u_requests;
uniform int u_light;
#endif
uniform sampler2D u_per_sample;
uniform vec4 u_background; // linear; alpha 0: transparent
#if GLS_OUTPUT == 1
layout(r32f, binding = 0) writeonly uniform image2D u_visibility;
#else
layout(rgba8, binding = 0) writeonly uniform image2D u_image;
#if GLS_SUM
layout(rgba32f, binding = 1) writeonly uniform image2D u_linear;
#endif
#endif

void main() {
    ivec2 block = ivec2(gl_FragCoord.xy);
    int place = block.y * u_batch.z + block.x;
    bool valid = place < u_batch.y;
    uint bits = texelFetch(u_pixels, u_batch.x + (valid ? place : 0)).r;
    ivec2 pixel = valid ? ivec2(int(bits & 0xffffu), int(bits >> 16u)) : ivec2(-1); // writes outside the image are discarded
#if GLS_OUTPUT == 1
    ivec2 there = max(pixel, ivec2(0));
    uint asking = texelFetch(u_requests, request_at(there, u_light, textureSize(u_mixed, 0).y), 0).r & request_bit(u_light);
    pixel = asking != 0u || texelFetch(u_mixed, there, 0).r == MIXED ? pixel : ivec2(-1);
#endif
    vec4 total = vec4(0.0);
#if GLS_TONE || GLS_EXPOSED
    vec3 surfaces = vec3(0.0); // exposed, without the background
#endif
    for (int i = 0; i < GLS_COLUMNS * GLS_ROWS; i++) {
        vec4 found = texelFetch(u_per_sample, block * BLOCK + ivec2(i % GLS_COLUMNS, i / GLS_COLUMNS), 0);
#if GLS_OUTPUT == 1
        total += isnan(found.r) ? vec4(0.0) : vec4(found.r, 1.0, 0.0, 0.0);
#else
        vec4 shown = found.a > 0.5 ? finished(found.rgb, found.a > 1.5) : vec4(0.0);
        total += vec4(shown.rgb + u_background.rgb * (1.0 - shown.a), shown.a);
#if GLS_TONE || GLS_EXPOSED
        surfaces += exposed(shown.rgb);
#endif
#endif
    }
#if GLS_OUTPUT == 1
    imageStore(u_visibility, pixel, vec4(total.r / total.g)); // NaN if no sample sees a surface
#else
    total /= float(GLS_COLUMNS * GLS_ROWS);
#if GLS_SUM
    imageStore(u_linear, pixel, total);
#endif
    bool opaque = u_background.a > 0.5;
    vec3 shown = opaque ? total.rgb : total.rgb / max(total.a, 1e-6);
#if GLS_TONE || GLS_EXPOSED
    surfaces /= float(GLS_COLUMNS * GLS_ROWS) * max(total.a, 1e-6);
    vec3 mapped = toned(surfaces);
    vec3 over = opaque ? total.a * mapped + u_background.rgb * (1.0 - total.a) : mapped;
#if GLS_EXPOSED
    shown = over;
#else
    shown = tone_peak(surfaces) <= TONE_START ? shown : over; // to the bit what it is without a tone map
#endif
#endif
    imageStore(u_image, pixel, vec4(srgb(clamp(shown, 0.0, 1.0)), total.a));
#endif
}
