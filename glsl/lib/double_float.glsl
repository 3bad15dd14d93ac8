// Double-float arithmetic for drivers without double: a sum of two floats, the second at most half a unit in the last place of the first.
// Dekker 1971, "A floating-point technique for extending the available precision"; Knuth, The Art of Computer Programming 2, 4.2.2.
// `precise` prevents reordering of sums. Relative error of a product or a sum of like signs: 2^-45.

vec2 quick_sum(float a, float b) { // |a| >= |b|
    precise float s = a + b;
    precise float rest = b - (s - a);
    return vec2(s, rest);
}

vec2 exact_sum(float a, float b) {
    precise float s = a + b;
    precise float part = s - a;
    precise float rest = (a - (s - part)) + (b - part);
    return vec2(s, rest);
}

vec2 halves(float a) { // of 12 bits each
    precise float t = 4097.0 * a;
    precise float high = t - (t - a);
    precise float low = a - high;
    return vec2(high, low);
}

vec2 exact_product(float a, float b) {
    vec2 x = halves(a), y = halves(b);
    precise float p = a * b;
    precise float rest = ((x.x * y.x - p) + x.x * y.y + x.y * y.x) + x.y * y.y;
    return vec2(p, rest);
}

vec2 double_float_sum(vec2 a, vec2 b) {
    vec2 s = exact_sum(a.x, b.x);
    vec2 t = exact_sum(a.y, b.y);
    s = quick_sum(s.x, s.y + t.x);
    return quick_sum(s.x, s.y + t.y);
}

vec2 double_float_product(vec2 a, vec2 b) {
    vec2 p = exact_product(a.x, b.x);
    precise float rest = p.y + (a.x * b.y + a.y * b.x);
    return quick_sum(p.x, rest);
}
