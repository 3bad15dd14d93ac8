// Fragment shader of the caster pass: depth only, an alpha test, a metric, or both.
#ifndef GLS_METRIC
#define GLS_METRIC 0
#endif
#ifndef GLS_ALPHA
#define GLS_ALPHA 0
#endif
#ifndef GLS_TEXTURED
#define GLS_TEXTURED 0
#endif
#ifndef GLS_COLORED
#define GLS_COLORED 0
#endif
#ifndef GLS_PACKED
#define GLS_PACKED 0
#endif
#ifndef GLS_CHANNELS
#define GLS_CHANNELS 0 // 1: several lights share the target; each writes one channel and its own range of the depth buffer
#endif
#if GLS_ALPHA
uniform vec2 u_alpha; // factor, cutoff
#if GLS_TEXTURED
GLS_VARYING vec2 v_uv;
uniform sampler2D u_texture;
#endif
#if GLS_COLORED
GLS_VARYING float v_alpha;
#endif
#endif
#if GLS_METRIC
GLS_VARYING vec4 v_position_lc;
GLS_VARYING vec3 v_position_lv;
#if GLS_CHANNELS
uniform vec2 u_depth_range; // first, size
#endif
#include <metric>
#include "lib/packing.glsl"
#if GLS_CORE
layout(location = 0) out vec4 o_stored;
#else
#define o_stored gl_FragColor
#endif
#endif

void main() {
#if GLS_ALPHA
    float alpha = u_alpha.x;
#if GLS_COLORED
    alpha *= v_alpha;
#endif
#if GLS_TEXTURED
    alpha *= GLS_TEXTURE_2D(u_texture, v_uv).a;
#endif
    if (alpha < u_alpha.y) discard;
#endif
#if GLS_METRIC
    float metric = depth_metric(v_position_lc, v_position_lv);
#if GLS_PACKED
    o_stored = pack(min(metric, 0.99999994)); // 1 would wrap to 0
#elif GLS_CHANNELS
    o_stored = vec4(metric); // the colour mask selects the channel
    gl_FragDepth = u_depth_range.x + u_depth_range.y * clamp(metric, 0.0, 1.0);
#else
    o_stored = vec4(metric, 0.0, 0.0, 1.0);
#endif
#endif
}
