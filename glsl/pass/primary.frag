// Which pixels surely show the triangle that their ray meets. GL snaps vertices to 1/256 pixel, so that beside an edge it may draw another
// one. A pixel whose ray lies well inside the triangle that was drawn keeps it; of all others nothing is kept, neither number nor depth:
// pass/surface.geom and pass/surface.frag find what their rays meet.
#ifndef GLS_SURFACE
#define GLS_SURFACE 1
#endif
#ifndef GLS_ORTHO
#define GLS_ORTHO 0
#endif
#include "lib/sight.glsl"
#include "lib/surface_number.glsl"
#include "lib/ray_triangle.glsl"
uniform usampler2D u_surface; // as GL drew it
uniform sampler2D u_camera_depth;
uniform float u_clear_depth; // window depth of nothing
const float MARGIN = 1.0 / 128.0; // pixels; more than the snap moves an edge
#if GLS_SURFACE == 1
layout(location = 0) out uint o_surface;
#elif GLS_SURFACE == 2
layout(location = 0) out uvec2 o_surface;
#else
layout(location = 0) out uvec4 o_surface;
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uvec4 own = texelFetch(u_surface, pixel, 0);
    float depth = texelFetch(u_camera_depth, pixel, 0).r;
#if __VERSION__ >= 400
    // An edge so near to the pixel's middle leaves one of its four neighbours to another triangle.
    ivec2 last = textureSize(u_surface, 0) - 1;
    vec2 size = vec2(last + 1);
    uvec4 below = textureGather(u_surface, vec2(pixel) / size), above = textureGather(u_surface, vec2(pixel + 1) / size);
    bool even = all(equal(uvec4(below.x, below.z, above.x, above.z), uvec4(own.r)))
        && all(greaterThan(pixel, ivec2(0))) && all(lessThan(pixel, last));
#else
    bool even = false;
#endif
    bool sure = true;
    int tests = own.r == 0u || even ? 0 : 1; // a loop: llvmpipe skips nothing else
    for (int i = 0; i < tests; i++) {
        Hit hit = ray_triangle(triangle_of(own.r), v_eye_l, v_ray_l);
        sure = hit.met && hit.margin > MARGIN;
    }
    own = sure ? own : uvec4(0u);
    gl_FragDepth = sure ? depth : u_clear_depth;
#if GLS_SURFACE == 1
    o_surface = own.r;
#elif GLS_SURFACE == 2
    o_surface = own.rg;
#else
    o_surface = own;
#endif
}
