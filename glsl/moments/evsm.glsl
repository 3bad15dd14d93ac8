// Depth from -1 to 1, warped by exp(c x) and by -exp(-c x), each with its square.
// Lauritzen, McCool 2008, "Layered Variance Shadow Maps", section 5.
#ifndef GLS_EXPONENT
#define GLS_EXPONENT 42.0
#endif

vec2 bent(float x) {
    return vec2(exp(GLS_EXPONENT * x), -exp(-GLS_EXPONENT * x));
}

vec4 moments_of(float depth) {
    vec2 both = bent(2.0 * depth - 1.0);
    return vec4(both.x, both.x * both.x, both.y, both.y * both.y);
}
