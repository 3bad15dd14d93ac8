// Metric of a spot light: linear in depth, so the plane is followed in 1 / depth. stored = x + y / base, base = 1 / depth.
#ifndef GLS_SLACK_TEXELS
#define GLS_SLACK_TEXELS 1.0
#endif
#ifndef GLS_FOLLOW_PLANE
#define GLS_FOLLOW_PLANE 1
#endif
uniform vec3 u_depth; // x minus the constant slack; y; unused

void start_depth(inout Receiver receiver) {
#if GLS_FOLLOW_PLANE
    receiver.depth += GLS_SLACK_TEXELS * (abs(receiver.slope.x) + abs(receiver.slope.y));
#else
    receiver.slope = vec2(0.0);
#endif
}

float compare_depth(Receiver receiver, vec2 offset) {
    float inverse = max(receiver.depth + dot(receiver.slope, offset), 1e-30); // a ray that misses the plane: infinitely far
    return clamp(u_depth.x + u_depth.y / inverse, 0.0, 1.0);
}

// Nearness to the light, in a unit in which edge width is linear in the difference: 1 / depth.
float stored_nearness(Receiver receiver, float stored) {
    return u_depth.y / max(stored - u_depth.x, 1e-30);
}

float receiver_nearness(Receiver receiver) {
    return receiver.depth;
}

float greatest_nearness() {
    return u_depth.y / max(-u_depth.x, 1e-30);
}
