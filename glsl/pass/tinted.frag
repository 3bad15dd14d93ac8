// Collects the pixels whose samples translucent casters may tint differently, for the image alone: they are in no light's requests but in the
// highest bit of the first word (lib/sample_requests.glsl), so that visibility does not know them. Drawn for each light, after those of
// pass/collect.frag, over all surfaces; no pixel is collected twice. Positions as in pass/transmittance.frag.
#ifndef GLS_ORTHO
#define GLS_ORTHO 0
#endif
#include "lib/camera_rays.glsl"
#include "lib/surface_number.glsl"
#include "lib/tint.glsl"
#include "lib/pixel_footprint.glsl"
layout(early_fragment_tests) in;
layout(std430, binding = 0) buffer Collected { uint collected_count; };
layout(std430, binding = 1) writeonly buffer Pixels { uint pixels[]; }; // x, y << 16
layout(r32ui, binding = 0) uniform uimage2D u_requests;
uniform usampler2D u_surface;
uniform sampler2D u_camera_depth;
uniform samplerBuffer u_planes; // per drawn triangle: unit world normal, distance from the scene's origin
uniform int u_words; // of requests, for each pixel
flat in vec2 v_unproject;
flat in vec3 v_lv_from_l;
flat in mat3 v_axes_l;
const float SAME_TINT = 0.05; // as much as colours of one surface may differ in pass/fill.frag
const uint IMAGE_ALONE = 0x80000000u;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 plane = texelFetch(u_planes, triangle_of(texelFetch(u_surface, pixel, 0).r));
    vec3 normal = v_axes_l * plane.xyz;
    float depth = v_unproject.x + v_unproject.y * texelFetch(u_camera_depth, pixel, 0).r;
#if !GLS_ORTHO
    depth = 1.0 / depth;
#endif
    vec3 position = v_eye_l + v_ray_l * depth;
    position += normal * (plane.w - dot(normal, position)) + v_lv_from_l;
    normal *= dot(normal, v_ray_l) > 0.0 ? -1.0 : 1.0; // the visible side
    PixelFootprint f = pixel_footprint(position, normal, v_eye_l + v_lv_from_l, v_ray_l);
    vec3 least = transmitted(f.middle, normal), most = least;
    for (int i = 0; i < 4; i++) {
        vec3 corner = f.middle + f.right * (i % 2 == 0 ? -1.0 : 1.0) + f.up * (i < 2 ? -1.0 : 1.0);
        vec3 tint = transmitted(corner, normal);
        least = min(least, tint);
        most = max(most, tint);
    }
    int height = textureSize(u_surface, 0).y;
    ivec2 last = pixel + ivec2(0, height * (u_words - 1)); // not 0: a light requests it
    uint first = imageLoad(u_requests, pixel).r;
    bool known = f.mixed || imageLoad(u_requests, last).r != 0u || first >= IMAGE_ALONE;
    int turns = !known && any(greaterThan(most - least, vec3(SAME_TINT))) ? 1 : 0;
    for (int i = 0; i < turns; i++) { // not an if: llvmpipe would execute the atomics for every pixel
        pixels[atomicAdd(collected_count, 1u)] = uint(pixel.x) | uint(pixel.y) << 16u;
        imageStore(u_requests, pixel, uvec4(first | IMAGE_ALONE));
    }
}
