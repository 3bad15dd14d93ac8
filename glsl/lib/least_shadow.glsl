// Lower bound of the share before x for all distributions with the four moments b, attained by three depths, one of them x.
// GLS_HAUSDORFF: depths are within -1 and 1; where one of the three would lie outside, the ends of the interval take part.
// Peters, Klein 2015, algorithm 3 and section 3.3. Twin: glshadow.shadows.filters.msm.least_before
#ifndef GLS_HAUSDORFF
#define GLS_HAUSDORFF 0
#endif

float least_shadow(vec4 b, float x) {
    // Cholesky of the Hankel matrix (1 b1 b2; b1 b2 b3; b2 b3 b4) times c = (1, x, x^2): roots of c1 + c2 z + c3 z^2 are the other depths
    float below = b.z - b.x * b.y, d22 = b.y - b.x * b.x;
    float d33 = (b.w - b.y * b.y) * d22 - below * below; // times d22
    float l32 = below / d22;
    float c2 = x - b.x;
    float c3 = (x * x - b.y - l32 * c2) * d22 / d33;
    c2 = c2 / d22 - l32 * c3;
    float c1 = 1.0 - c2 * b.x - c3 * b.y;
    float half_sum = -0.5 * c2 / c3;
    float root = sqrt(max(half_sum * half_sum - c1 / c3, 0.0));
    float first = half_sum - root, last = half_sum + root;
#if GLS_HAUSDORFF
    if (first < -1.0 || last > 1.0) { // a distribution on -1, 1, x and a fourth depth, with the same moments
        float inner = (b.x - b.z) - x * (1.0 - b.y); // mean of (1 - z^2)(z - x)
        float other = ((b.y - b.w) - x * (b.x - b.z)) / inner;
        float sum = x + other, product = x * other;
        float end = (b.y - sum * b.x + product - b.z + sum * b.y - product * b.x) / (2.0 * (1.0 + x) * (1.0 + other));
        return end + (other < x ? inner / ((1.0 - other * other) * (other - x)) : 0.0);
    }
#endif
    // weights of the depths before x
    if (last < x) return 1.0 - (first * last - b.x * (first + last) + b.y) / ((x - first) * (x - last));
    return first < x ? (x * last - b.x * (x + last) + b.y) / ((first - x) * (first - last)) : 0.0;
}
