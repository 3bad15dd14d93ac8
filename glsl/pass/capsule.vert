// Vertex shader of capsules, seen by a camera or a light, without attributes: a triangle around each ball, or a rectangle of two around each tube.
#ifndef GLS_CAPSULES
#define GLS_CAPSULES 1 // 2: also tubes
#endif
#ifndef GLS_ORTHO
#define GLS_ORTHO 0 // 1: an orthographic view
#endif
#include "lib/capsule_view.glsl"
uniform usamplerBuffer u_corners; // per element: its ends and its radius as vertices, its node
uniform samplerBuffer u_positions; // relative to the scene's origin; w: what float cuts off
uniform int u_first; // the draw's first element, from 0 over the scene
uniform uint u_marks; // flags of the node: lib/surface_number.glsl
uniform vec2 u_margin; // NDC: more than snapping moves an edge
flat out vec3 v_a; // the ends in the view, from its eye
flat out float v_radius;
#if GLS_CAPSULES == 2
flat out vec3 v_b;
#endif
flat out uint v_number;
flat out uvec2 v_ends; // vertices
const float MARGINS = 32.0; // in a pixel: twin of glshadow.gl.passes.capsules
const float NEAR_SHARE = 1e-3; // of a radius: nearer to the eye's plane an element may cover anything
#if GLS_CAPSULES == 1
const int CORNERS = 3;
const vec2 PLACES[3] = vec2[3](vec2(-1.7320509, -1.0), vec2(1.7320509, -1.0), vec2(0.0, 2.0)); // around the unit circle
#else
const int CORNERS = 6;
const vec2 PLACES[6] = vec2[6](vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(-1.0, 1.0), vec2(-1.0, 1.0), vec2(1.0, -1.0), vec2(1.0, 1.0));
#endif

vec2 tangents(float x, float w, float r) { // bounds of a ball's projection along one axis
    float across = sqrt(max(x * x + w * w - r * r, 0.0)) * r, below = w * w - r * r;
    return vec2(x * w - across, x * w + across) / below;
}

void main() {
    int element = u_first + gl_VertexID / CORNERS;
    uvec4 corners = texelFetch(u_corners, element);
    float r = texelFetch(u_positions, int(corners.z)).x;
    vec3 a = in_view(texelFetch(u_positions, int(corners.x)));
#if GLS_CAPSULES == 2
    vec3 b = in_view(texelFetch(u_positions, int(corners.y)));
    v_b = b;
#else
    vec3 b = a;
#endif
    v_a = a;
    v_radius = r;
    v_number = uint(element + 1) | u_marks;
    v_ends = corners.xy;
    float wide = 1.00001 * r, nearest = min(a.z, b.z) - wide, farthest = max(a.z, b.z) + wide;
#if GLS_ORTHO
    vec2 low = min(a.xy, b.xy) - wide, high = max(a.xy, b.xy) + wide;
    bool anywhere = false, seen = true;
#else
    vec2 ax = tangents(a.x, a.z, wide), ay = tangents(a.y, a.z, wide), bx = tangents(b.x, b.z, wide), by = tangents(b.y, b.z, wide);
    vec2 low = vec2(min(ax.x, bx.x), min(ay.x, by.x)), high = vec2(max(ax.y, bx.y), max(ay.y, by.y));
    bool anywhere = nearest <= NEAR_SHARE * r, seen = farthest > 0.0;
#endif
    low = (low - u_window.zw) / u_window.xy - u_margin;
    high = (high - u_window.zw) / u_window.xy + u_margin;
    seen = seen && (anywhere || all(lessThan(low, vec2(1.0))) && all(greaterThan(high, vec2(-1.0))));
    vec2 first = ceil((low + 1.0) / (MARGINS * u_margin) - 0.5), last = floor((high + 1.0) / (MARGINS * u_margin) - 0.5);
    seen = seen && (anywhere || all(lessThanEqual(first, last))); // else it covers no pixel's centre
    vec2 place = PLACES[gl_VertexID % CORNERS];
#if GLS_CAPSULES == 1
    low = anywhere ? vec2(-1.5) : low; // more than the image, which is a square seen from the circle
    high = anywhere ? vec2(1.5) : high;
#if !GLS_ORTHO
    // a ball is an ellipse; scaled to a square, it reaches beyond the circle along one diagonal
    vec2 squares = a.xy * a.xy + a.z * a.z - wide * wide;
    place *= anywhere ? 1.0 : sqrt(1.0 + min(abs(a.x * a.y) * inversesqrt(squares.x * squares.y), 1.0)) * 1.00001;
#endif
#else
    low = anywhere ? vec2(-1.0) : max(low, vec2(-1.0));
    high = anywhere ? vec2(1.0) : min(high, vec2(1.0));
#endif
    // without area where it is not seen; outside the window llvmpipe would send all vertices of the batch through its clipper
    gl_Position = seen ? vec4(mix(low, high, 0.5 * place + 0.5), 0.5, 1.0) : vec4(0.0, 0.0, 0.5, 1.0);
}
