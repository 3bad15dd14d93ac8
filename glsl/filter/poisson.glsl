// The mean of four nearest comparisons at scattered offsets. The plane is followed to each texel's centre.
// The offsets are those of Babylon.js and many earlier programs (a Poisson disc). GLS_POISSON_ROTATE: rotated per pixel.
// Twin: glshadow.shadows.filters.poisson
#ifndef GLS_POISSON_RADIUS
#define GLS_POISSON_RADIUS 1.0
#endif
#ifndef GLS_POISSON_ROTATE
#define GLS_POISSON_ROTATE 0
#endif
#if GLS_POISSON_ROTATE
#include "lib/gradient_noise.glsl"
#endif

float poisson_tap(Receiver receiver, vec2 offset) {
    vec2 place = floor(receiver.texel + GLS_POISSON_RADIUS * offset) + 0.5;
    return compare_one(place, compare_depth(receiver, place - receiver.texel));
}

float visibility(Receiver receiver) {
#if GLS_POISSON_ROTATE
    float turn = 6.2831853 * gradient_noise(gl_FragCoord.xy);
    mat2 turned = mat2(cos(turn), sin(turn), -sin(turn), cos(turn));
#else
    const mat2 turned = mat2(1.0);
#endif
    return 0.25 * (poisson_tap(receiver, turned * vec2(-0.94201624, -0.39906216)) +
                   poisson_tap(receiver, turned * vec2(0.94558609, -0.76890725)) +
                   poisson_tap(receiver, turned * vec2(-0.094184101, -0.92938870)) +
                   poisson_tap(receiver, turned * vec2(0.34495938, 0.29387760)));
}
