// What a depth map stores, as what a filter wants the mean of.
#ifndef GLS_SUN
#define GLS_SUN 0
#endif
#include <encoding>
uniform sampler2D u_stored;
uniform vec4 u_even; // window depth = x + y * base, base distance along a sun's view or 1 / depth; near; 1 / (far - near)
uniform vec2 u_from; // from a texel here to that of the depth map
layout(location = 0) out vec4 o_moments;

void main() {
    float base = (texelFetch(u_stored, ivec2(gl_FragCoord.xy + u_from), 0).r - u_even.x) / u_even.y;
#if GLS_SUN
    float away = base;
#else
    float away = 1.0 / max(base, 1e-30);
#endif
    o_moments = moments_of(clamp((away - u_even.z) * u_even.w, 0.0, 1.0));
}
