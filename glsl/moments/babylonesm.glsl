// Babylon.js's exponential shadow maps store exp(-k metric), or, with "close", the metric.
#ifndef GLS_EXPONENT
#define GLS_EXPONENT 50.0
#endif
#ifndef GLS_CLOSE
#define GLS_CLOSE 0
#endif

vec4 moments_of(float depth) {
#if GLS_CLOSE
    return vec4(depth, 0.0, 0.0, 0.0);
#else
    return vec4(clamp(exp(-min(87.0, GLS_EXPONENT * depth)), 0.0, 1.0), 0.0, 0.0, 0.0);
#endif
}
