// Exponential shadow map: the mean of exp(c (stored depth - receiver's depth)), at most 1. On the receiver's own plane it is at least 1,
// whatever the slope, so it needs no bias. Annen, Mertens, Seidel, Flerackers, Kautz 2008. Twin: glshadow.shadows.filters.esm
#include "moments/esm.glsl"
#ifndef GLS_EXPONENT
#define GLS_EXPONENT 80.0
#endif

float visibility(Receiver receiver) {
    return min(moments_at(receiver).x * exp(-GLS_EXPONENT * receiver.depth), 1.0);
}
