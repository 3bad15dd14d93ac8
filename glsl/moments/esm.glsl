// exp(c depth): its mean, over that of the receiver's own depth, is the product of two factors that each know one of the two.
// Annen, Mertens, Seidel, Flerackers, Kautz 2008, "Exponential Shadow Maps".
#ifndef GLS_EXPONENT
#define GLS_EXPONENT 80.0
#endif

vec4 moments_of(float depth) {
    return vec4(exp(GLS_EXPONENT * depth), 0.0, 0.0, 0.0);
}
