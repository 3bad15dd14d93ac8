// Babylon.js's exponential shadow maps. "Close": exp(-k (metric - mean of stored metrics)), else 1 - exp(k metric) * mean of exp(-k stored
// metric), which is 0 where the receiver is the stored surface. Babylon.js 9.34, shadowsFragmentFunctions.
// Twin: glshadow.shadows.filters.babylon_esm
#include "moments/babylonesm.glsl"
#ifndef GLS_EXPONENT
#define GLS_EXPONENT 50.0
#endif
#ifndef GLS_CLOSE
#define GLS_CLOSE 0
#endif

float visibility(Receiver receiver) {
    float stored = moments_at(receiver).x, metric = clamp(receiver.depth, 0.0, 1.0);
#if GLS_CLOSE
    return clamp(exp(min(87.0, -GLS_EXPONENT * (metric - stored))), 0.0, 1.0);
#else
    return 1.0 - clamp(exp(min(87.0, GLS_EXPONENT * metric)) * stored, 0.0, 1.0);
#endif
}
