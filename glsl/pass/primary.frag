// Resets the depth of pixels that may not show what their rays hit. GL snaps vertices to 1/256 pixel, so that beside an edge it may draw
// another triangle. A pixel whose ray is well inside the drawn triangle keeps it; all others are reset, and pass/surface.geom and
// pass/surface.frag find what their rays hit. Draw at the far plane, with a depth attachment only.
#ifndef GLS_ORTHO
#define GLS_ORTHO 0
#endif
#include "lib/camera_rays.glsl"
#include "lib/surface_number.glsl"
#include "lib/ray_triangle.glsl"
uniform usampler2D u_surface; // as GL rasterised it
const float MARGIN = 1.0 / 128.0; // pixels; more than snapping moves an edge

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(u_surface, 0) - 1;
#if __VERSION__ >= 400
    // an edge this near to the pixel's centre leaves one of its four neighbours to another triangle
    vec2 size = vec2(last + 1);
    uint own = texelFetch(u_surface, pixel, 0).r;
    uvec4 below = textureGather(u_surface, vec2(pixel) / size), above = textureGather(u_surface, vec2(pixel + 1) / size);
    bool even = all(equal(uvec4(below.x, below.z, above.x, above.z), uvec4(own)))
        && all(greaterThan(pixel, ivec2(0))) && all(lessThan(pixel, last));
#else
    uint own = texelFetch(u_surface, pixel, 0).r;
    bool even = false;
#endif
    bool sure = true;
    int tests = even ? 0 : 1; // a loop, because llvmpipe skips nothing else
    for (int i = 0; i < tests; i++) {
        Hit hit = ray_triangle(triangle_of(own), v_eye_l, v_ray_l);
        sure = hit.met && hit.margin > MARGIN;
    }
    if (sure) discard;
}
