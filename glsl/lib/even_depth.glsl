// Depth linear in the distance along the light's axis, 0 at near, 1 at far, as moment maps store it.
// Directional light: u_depth.x + base. Others: u_depth.x + u_depth.y / base, base = 1 / depth.
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_FOLLOW_PLANE
#define GLS_FOLLOW_PLANE 1
#endif
uniform vec3 u_depth; // constant minus the constant slack; growth per world unit; unused

void start_depth(inout Receiver receiver) {
#if GLS_AT_INFINITY
    receiver.depth += u_depth.x;
#else
    float away = 1.0 / max(receiver.depth, 1e-30);
    receiver.slope *= -u_depth.y * away * away;
    receiver.depth = u_depth.x + u_depth.y * away;
#endif
#if !GLS_FOLLOW_PLANE
    receiver.slope = vec2(0.0);
#endif
    receiver.depth = min(receiver.depth, 1.0); // beyond far nothing is stored
}
