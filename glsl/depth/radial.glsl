// Metric of a point light: the distance, length(tangent, 1) / (1 / depth) on the plane. stored = x + y * distance, base = 1 / depth.
#ifndef GLS_SLACK_TEXELS
#define GLS_SLACK_TEXELS 1.0
#endif
#ifndef GLS_FOLLOW_PLANE
#define GLS_FOLLOW_PLANE 1
#endif
uniform vec3 u_depth; // x minus the constant slack; y; size of a texel as tangent

void start_depth(inout Receiver receiver) {
#if GLS_FOLLOW_PLANE
    receiver.depth += GLS_SLACK_TEXELS * (abs(receiver.slope.x) + abs(receiver.slope.y));
    // length(tangent, 1) itself changes by at most half its value per tangent and axis: d ln sqrt(1 + x^2) / dx <= 1/2
    receiver.depth *= 1.0 + GLS_SLACK_TEXELS * u_depth.z;
#else
    receiver.slope = vec2(0.0);
#endif
}

float compare_depth(Receiver receiver, vec2 offset) {
#if GLS_FOLLOW_PLANE
    float stretch = length(vec3(receiver.tangent + offset * u_depth.z, 1.0));
#else
    float stretch = length(vec3(receiver.tangent, 1.0));
#endif
    float inverse = max(receiver.depth + dot(receiver.slope, offset), 1e-30); // a ray that misses the plane: infinitely far
    return clamp(u_depth.x + u_depth.y * stretch / inverse, 0.0, 1.0);
}

// Nearness to the light, in a unit in which edge width is linear in the difference: 1 / depth.
float stored_nearness(Receiver receiver, float stored) {
    return length(vec3(receiver.tangent, 1.0)) * u_depth.y / max(stored - u_depth.x, 1e-30);
}

float receiver_nearness(Receiver receiver) {
    return receiver.depth;
}

float greatest_nearness() {
    return u_depth.y / max(-u_depth.x, 1e-30);
}
