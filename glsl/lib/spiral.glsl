// Points of the unit disc with equal areas: point i of n at sqrt((i + 1/2) / n), rotated by i golden angles (Vogel 1979).
// Twin: glshadow.core.sample_patterns.disc
vec2 spiral(int i, int count) {
    float angle = float(i) * 2.3999632;
    return vec2(cos(angle), sin(angle)) * sqrt((float(i) + 0.5) / float(count));
}
