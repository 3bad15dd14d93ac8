// Four powers of depth from -1 to 1. GLS_HALF: rotated such that each of four numbers from 0 to 1 uses its 16 bits.
// Peters, Klein 2015, "Moment Shadow Mapping"; Peters, Muenstermann, Wetzstein, Klein 2017, "Improved Moment Shadow Maps".
#ifndef GLS_HALF
#define GLS_HALF 0
#endif

vec4 moments_of(float depth) {
    float x = 2.0 * depth - 1.0, square = x * x;
#if GLS_HALF
    // 3/2 x - 2 x^3 and sqrt(3) (1/2 x - 2/9 x^3) lie in -1/2 .. 1/2, 4 (x^2 - x^4) and (x^2 + x^4) / 2 in 0 .. 1
    return vec4(x * (1.5 - 2.0 * square) + 0.5, x * (0.8660254 - 0.3849002 * square) + 0.5,
                4.0 * square * (1.0 - square), 0.5 * square * (1.0 + square));
#else
    return vec4(x, square, x * square, square * square);
#endif
}

// The means of the powers from the means of the stored values.
vec4 powers(vec4 stored) {
#if GLS_HALF
    vec2 odd = stored.xy - 0.5;
    // inverse of (3/2, -2; sqrt(3)/2, -2 sqrt(3)/9), whose determinant is 2 / sqrt(3), and of (4, -4; 1/2, 1/2)
    return vec4(-0.3333333 * odd.x + 1.7320508 * odd.y, 0.125 * stored.z + stored.w,
                -0.75 * odd.x + 1.2990381 * odd.y, -0.125 * stored.z + stored.w);
#else
    return stored;
#endif
}
