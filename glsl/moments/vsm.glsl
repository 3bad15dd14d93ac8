// Depth and its square, for depth from -1 to 1: the same variance at half the rounding.
// Donnelly, Lauritzen 2006, "Variance Shadow Maps".
vec4 moments_of(float depth) {
    float x = 2.0 * depth - 1.0;
    return vec4(x, x * x, 0.0, 0.0);
}
