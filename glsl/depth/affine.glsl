// Stored depth that is affine over the map: window depth of every light, and a directional light's metric. stored = u_depth + base.
#ifndef GLS_SLACK_TEXELS
#define GLS_SLACK_TEXELS 1.0
#endif
#ifndef GLS_REVERSED
#define GLS_REVERSED 0
#endif
#ifndef GLS_FOLLOW_PLANE
#define GLS_FOLLOW_PLANE 1
#endif
uniform float u_depth; // constant minus the constant slack

void start_depth(inout Receiver receiver) {
#if GLS_FOLLOW_PLANE
    float slack = GLS_SLACK_TEXELS * (abs(receiver.slope.x) + abs(receiver.slope.y));
    receiver.depth += GLS_REVERSED == 1 ? slack : -slack; // nearer
#else
    receiver.slope = vec2(0.0);
#endif
    receiver.depth += u_depth;
}

// Clamped as GL does, for fixed-point formats only: a float map must not return "dark" beyond far, where nothing is stored.
float compare_depth(Receiver receiver, vec2 offset) {
    float depth = receiver.depth + dot(receiver.slope, offset);
    return GLS_REVERSED == 1 ? max(depth, 0.0) : min(depth, 1.0);
}

// Nearness to the light, in a unit in which edge width is linear in the difference: window depth, or a directional light's metric.
float stored_nearness(Receiver receiver, float stored) {
    return GLS_REVERSED == 1 ? stored : -stored;
}

float receiver_nearness(Receiver receiver) {
    return stored_nearness(receiver, receiver.depth);
}

float greatest_nearness() {
    return GLS_REVERSED == 1 ? 1.0 : 0.0;
}
