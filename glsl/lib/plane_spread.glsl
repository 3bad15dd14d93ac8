// Spread of a plane's depth over the kernel of a moment map: a box of 2 R + 1 texels, blurred once more by hardware bilinear filtering.
#ifndef GLS_MIP_LEVELS
#define GLS_MIP_LEVELS 0
#endif
#ifndef GLS_MOMENT_RADIUS
#define GLS_MOMENT_RADIUS 1
#endif

// Standard deviation: variances add up, (w^2 - 1) / 12 of w texels in a row and at most 1/4 of two neighbours; of a mip map m texels wide
// (m^2 - 1) / 12 and m^2 / 4, of two levels their mean.
float plane_deviation(Receiver receiver) {
    const float width = float(2 * GLS_MOMENT_RADIUS + 1);
    float variance = (width * width - 1.0) / 12.0 + 0.25;
#if GLS_MIP_LEVELS
    float level = floor(receiver.level);
    variance += (exp2(2.0 * level) * (1.0 + 3.0 * (receiver.level - level)) - 1.0) / 3.0;
#endif
    return length(receiver.slope) * sqrt(variance);
}

// Largest deviation of depth.
float plane_extent(Receiver receiver) {
    float reach = float(GLS_MOMENT_RADIUS + 1);
#if GLS_MIP_LEVELS
    reach += 1.5 * (exp2(ceil(receiver.level)) - 1.0);
#endif
    return (abs(receiver.slope.x) + abs(receiver.slope.y)) * reach;
}
