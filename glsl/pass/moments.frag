// Converts a depth map into what a filter averages; with GLS_ROW, its mean over 2 R + 1 texels in a row.
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_ROW
#define GLS_ROW 0 // R
#endif
#include <encoding>
uniform sampler2D u_stored;
uniform vec4 u_even; // window depth = x + y * base, base: depth (directional light) or 1 / depth; near; 1 / (far - near)
uniform vec2 u_from; // offset from a texel here to that of the depth map
layout(location = 0) out vec4 o_moments;

vec4 moments_at(ivec2 texel) {
    float base = (texelFetch(u_stored, texel, 0).r - u_even.x) / u_even.y;
#if GLS_AT_INFINITY
    float away = base;
#else
    float away = 1.0 / max(base, 1e-30);
#endif
    return moments_of(clamp((away - u_even.z) * u_even.w, 0.0, 1.0));
}

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy + u_from);
#if GLS_ROW
    int most = textureSize(u_stored, 0).x - 1;
    vec4 sum = vec4(0.0);
    for (int i = -GLS_ROW; i <= GLS_ROW; i++) {
        sum += moments_at(ivec2(clamp(texel.x + i, 0, most), texel.y));
    }
    o_moments = sum / float(2 * GLS_ROW + 1);
#else
    o_moments = moments_at(texel);
#endif
}
