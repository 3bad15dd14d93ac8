// The mean of bilinear comparisons on a spiral that fills a disc evenly: tap i of n at sqrt((i + 1/2) / n), rotated by i golden angles.
// The plane is followed to each tap's 2 x 2 texels. GLS_DISC_ROTATE: rotated per pixel by interleaved gradient noise.
// Vogel 1979; Castano 2013; Jimenez 2014. Twin: glshadow.shadows.filters.disc
#ifndef GLS_DISC_RADIUS
#define GLS_DISC_RADIUS 2.0
#endif
#ifndef GLS_DISC_TAPS
#define GLS_DISC_TAPS 16
#endif
#ifndef GLS_DISC_ROTATE
#define GLS_DISC_ROTATE 0
#endif
#include "lib/spiral.glsl"
#include "lib/bilinear_tap.glsl"
#if GLS_DISC_ROTATE
#include "lib/gradient_noise.glsl"
#endif

float visibility(Receiver receiver) {
#if GLS_DISC_ROTATE
    float turn = 6.2831853 * gradient_noise(gl_FragCoord.xy);
    vec2 axis = vec2(cos(turn), sin(turn));
#endif
    float sum = 0.0;
    for (int i = 0; i < GLS_DISC_TAPS; i++) {
        vec2 offset = GLS_DISC_RADIUS * spiral(i, GLS_DISC_TAPS);
#if GLS_DISC_ROTATE
        offset = vec2(axis.x * offset.x - axis.y * offset.y, axis.y * offset.x + axis.x * offset.y);
#endif
        sum += bilinear_tap(receiver, offset);
    }
    return min(sum / float(GLS_DISC_TAPS), 1.0); // a fully lit area may round above 1
}
