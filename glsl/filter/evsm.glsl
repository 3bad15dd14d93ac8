// Exponential variance shadow map: Chebyshev's bound of warped depth; GLS_COMPONENTS 4: warped both ways, the lower of the two bounds.
// On the receiver's own plane the mean of exp(c x) is at least that of its centre. The mean of -exp(-c x) is nearer, as if x were nearer by
// c s^2 / 2, s the deviation over the kernel, and by no more than the plane's extent: this much is subtracted.
// Lauritzen, McCool 2008. Twin: glshadow.shadows.filters.vsm
#include "moments/evsm.glsl"
#include "lib/chebyshev.glsl"
#include "lib/plane_spread.glsl"
#ifndef GLS_EXPONENT
#define GLS_EXPONENT 42.0
#endif
#ifndef GLS_COMPONENTS
#define GLS_COMPONENTS 4
#endif
#ifndef GLS_ROUNDING
#define GLS_ROUNDING 2.4e-7 // of a stored square, relative
#endif
#ifndef GLS_BLEEDING
#define GLS_BLEEDING 0.0
#endif

float visibility(Receiver receiver) {
    vec4 stored = moments_at(receiver);
    float x = clamp(2.0 * receiver.depth - 1.0, -1.0, 1.0); // beyond it exp may be infinite
    float away = bent(x).x;
    float lit = chebyshev(stored.xy, away, GLS_ROUNDING * away * away, GLS_BLEEDING);
#if GLS_COMPONENTS == 4
    float deviation = 2.0 * plane_deviation(receiver);
    float back = bent(max(x - min(0.5 * GLS_EXPONENT * deviation * deviation, 2.0 * plane_extent(receiver)), -1.0)).y;
    lit = min(lit, chebyshev(stored.zw, back, GLS_ROUNDING * back * back, GLS_BLEEDING));
#endif
    return lit;
}
