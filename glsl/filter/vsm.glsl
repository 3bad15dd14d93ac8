// Variance shadow map: the upper bound of the light for the stored mean and variance. On the receiver's own plane the mean is its depth.
// Donnelly, Lauritzen 2006. Twin: glshadow.shadows.filters.vsm
#include "lib/chebyshev.glsl"
#ifndef GLS_ROUNDING
#define GLS_ROUNDING 2.4e-7 // of a stored square
#endif
#ifndef GLS_BLEEDING
#define GLS_BLEEDING 0.0
#endif

float visibility(Receiver receiver) {
    return chebyshev(moments_at(receiver).xy, 2.0 * receiver.depth - 1.0, GLS_ROUNDING, GLS_BLEEDING);
}
