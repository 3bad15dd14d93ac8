// Linear RGB in 0..1 to display values. IEC 61966-2-1, its power 1/2.4 fitted by square roots: off by at most 0.01 / 255,
// and cheaper than pow. Fit: least maximum error over 0.0031308..1, see tests/shader/test_srgb.py
vec3 srgb(vec3 linear) {
    vec3 a = sqrt(linear);
    vec3 b = sqrt(a);
    vec3 high = 0.65391315 * a + 0.68888055 * b - 0.31861524 * sqrt(b) - 0.02017613 * linear - 0.00403397;
    return mix(12.92 * linear, high, step(vec3(0.0031308), linear));
}
