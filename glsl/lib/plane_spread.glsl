// How a plane's depth spreads over what a moment map averages: a box of 2 R + 1 texels that the hardware's bilinear filter smears once more.
#ifndef GLS_MOMENT_RADIUS
#define GLS_MOMENT_RADIUS 1
#endif

// Standard deviation: variances add up, (w^2 - 1) / 12 of w texels in a row and at most 1/4 of two neighbours.
float plane_deviation(Receiver receiver) {
    const float width = float(2 * GLS_MOMENT_RADIUS + 1);
    return length(receiver.slope) * sqrt((width * width - 1.0) / 12.0 + 0.25);
}

// The most that depth differs.
float plane_extent(Receiver receiver) {
    return (abs(receiver.slope.x) + abs(receiver.slope.y)) * float(GLS_MOMENT_RADIUS + 1);
}
