// Upper bound of the share of values at or beyond x, from their mean and mean square (one-tailed Chebyshev), less a share that is taken as
// light bleeding. Donnelly, Lauritzen 2006, equation 5.
float chebyshev(vec2 moments, float x, float least_variance, float bleeding) {
    float beyond = x - moments.x;
    float variance = max(moments.y - moments.x * moments.x, least_variance);
    float share = variance / (variance + beyond * beyond);
    return beyond <= 0.0 ? 1.0 : clamp((share - bleeding) / (1.0 - bleeding), 0.0, 1.0);
}
