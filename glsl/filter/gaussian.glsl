// Percentage closer filtering under a bell: bilinear comparisons a texel apart, weighed 1 2 1, 1 3 4 3 1 or 1 5 12 16 12 5 1 along each axis,
// fetched as (R + 1)^2 blocks of 2 x 2 texels as in filter/pcf.glsl. The plane is followed from block to block.
// Castano 2013, "Shadow Mapping Summary": what others fetch in R + 1 taps that the hardware filters. Twin: glshadow.core.filters.gaussian
#ifndef GLS_GAUSSIAN_RADIUS
#define GLS_GAUSSIAN_RADIUS 1
#endif
#if GLS_GAUSSIAN_RADIUS == 1
#define GLS_GAUSSIAN_SUM 4.0
#elif GLS_GAUSSIAN_RADIUS == 2
#define GLS_GAUSSIAN_SUM 12.0
#else
#define GLS_GAUSSIAN_SUM 52.0
#endif

float bell(int i) { // weight of tap i of 2 R + 1; 0 beyond
    float away = abs(float(i - GLS_GAUSSIAN_RADIUS));
#if GLS_GAUSSIAN_RADIUS == 1
    return max(2.0 - away, 0.0);
#elif GLS_GAUSSIAN_RADIUS == 2
    return max(4.0 - 0.5 * away * (away + 1.0), 0.0);
#else
    return away < 0.5 ? 16.0 : away < 1.5 ? 12.0 : away < 2.5 ? 5.0 : away < 3.5 ? 1.0 : 0.0;
#endif
}

vec2 bell_at(int i, vec2 f) { // of texel i of a row and of a column: shares of the two taps that read it
    return bell(i) * (1.0 - f) + bell(i - 1) * f;
}

float visibility(Receiver receiver) {
    vec2 base = floor(receiver.texel - 0.5);
    vec2 f = receiver.texel - 0.5 - base;
    vec2 first = base + (1.0 - float(GLS_GAUSSIAN_RADIUS)); // corner in the middle of the first block
    float sum = 0.0;
    for (int j = 0; j <= GLS_GAUSSIAN_RADIUS; j++) {
        float lower = bell_at(2 * j, f).y, upper = bell_at(2 * j + 1, f).y;
        for (int i = 0; i <= GLS_GAUSSIAN_RADIUS; i++) {
            vec2 corner = first + 2.0 * vec2(float(i), float(j));
            vec4 lit = compare_four(corner, compare_depth(receiver, corner - receiver.texel));
            float left = bell_at(2 * i, f).x, right = bell_at(2 * i + 1, f).x;
            sum += lower * (lit.w * left + lit.z * right) + upper * (lit.x * left + lit.y * right);
        }
    }
    return min(sum / (GLS_GAUSSIAN_SUM * GLS_GAUSSIAN_SUM), 1.0); // a lit plateau may round above 1
}
