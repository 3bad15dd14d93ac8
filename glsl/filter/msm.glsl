// Moment shadow map: the lower bound of the shadow for four moments.
// On the receiver's own plane, depth minus one deviation over the kernel casts no shadow: the two other depths are beyond it.
// Peters, Klein 2015, algorithm 3 and section 3.3. Twin: glshadow.shadows.filters.msm
#include "moments/msm.glsl"
#include "lib/least_shadow.glsl"
#include "lib/plane_spread.glsl"
#ifndef GLS_MOMENT_BIAS
#define GLS_MOMENT_BIAS 3e-6
#endif
#ifndef GLS_BLEEDING
#define GLS_BLEEDING 0.0
#endif

float visibility(Receiver receiver) {
    vec4 moments = mix(powers(moments_at(receiver)), vec4(0.0, 0.375, 0.0, 0.375), GLS_MOMENT_BIAS);
    float shadow = clamp(least_shadow(moments, 2.0 * (receiver.depth - plane_deviation(receiver)) - 1.0), 0.0, 1.0);
    return clamp((1.0 - shadow - GLS_BLEEDING) / (1.0 - GLS_BLEEDING), 0.0, 1.0);
}
