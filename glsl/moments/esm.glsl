// exp(c depth). Its mean divided by that of the receiver's depth separates into a factor of the map and a factor of the receiver.
// Annen, Mertens, Seidel, Flerackers, Kautz 2008, "Exponential Shadow Maps".
#ifndef GLS_EXPONENT
#define GLS_EXPONENT 80.0
#endif

vec4 moments_of(float depth) {
    return vec4(exp(GLS_EXPONENT * depth), 0.0, 0.0, 0.0);
}
