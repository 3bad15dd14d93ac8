// Percentage closer soft shadows: a blocker search over the largest possible penumbra, whose mean gives the width of the edge, then a disc
// filter of that width. Nearness grows towards the light such that an edge is u_size * (nearness of the blocker - nearness of the receiver)
// texels wide: window depth does, and 1 / depth. Needs a <compare> that has `stored_at`.
// Fernando 2005.
#ifndef GLS_PCSS_BLOCKERS
#define GLS_PCSS_BLOCKERS 16
#endif
#ifndef GLS_PCSS_TAPS
#define GLS_PCSS_TAPS 32
#endif
#ifndef GLS_PCSS_MOST
#define GLS_PCSS_MOST 32.0 // texels
#endif
#include "lib/spiral.glsl"
#include "lib/bilinear_tap.glsl"
uniform vec2 u_size; // size of the light: texels per unit of nearness

float visibility(Receiver receiver) {
    // a disc that faces the receiver, projected through a point at depth 1: wider along the tangent
    float slant = length(receiver.tangent);
    vec2 along = slant > 1e-6 ? receiver.tangent / slant : vec2(1.0, 0.0);
    mat2 disc = mat2(along * sqrt(1.0 + slant * slant), vec2(-along.y, along.x));
    float own = receiver_nearness(receiver);
    vec2 reach = clamp(u_size * (greatest_nearness() - own), vec2(0.0), vec2(GLS_PCSS_MOST));
    float sum = 0.0, count = 0.0;
    for (int i = 0; i < GLS_PCSS_BLOCKERS; i++) {
        vec2 place = floor(receiver.texel + clamp(disc * spiral(i, GLS_PCSS_BLOCKERS) * reach, -GLS_PCSS_MOST, GLS_PCSS_MOST)) + 0.5;
        float blocked = 1.0 - compare_one(place, compare_depth(receiver, place - receiver.texel));
        sum += blocked > 0.5 ? stored_nearness(receiver, stored_at(place)) : 0.0;
        count += blocked > 0.5 ? 1.0 : 0.0;
    }
    vec2 radius = clamp(u_size * (sum / max(count, 1.0) - own), vec2(0.0), vec2(GLS_PCSS_MOST));
    float lit = 0.0;
    for (int i = 0; i < GLS_PCSS_TAPS; i++) {
        lit += bilinear_tap(receiver, clamp(disc * spiral(i, GLS_PCSS_TAPS) * radius, -GLS_PCSS_MOST, GLS_PCSS_MOST));
    }
    return count > 0.5 ? min(lit / float(GLS_PCSS_TAPS), 1.0) : 1.0;
}
