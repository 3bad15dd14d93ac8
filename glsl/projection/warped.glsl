// A directional light whose map is perspective-warped: points go through a matrix to texels and stored depth, planes through its inverse.
// With q = M (p, 1): texel = q.xy / q.w, depth = q.z / q.w; a plane (N, -N.P) is (N, -N.P) M^-1 there, and depth rises along it by -x/z, -y/z.
uniform mat4 u_warp;
uniform mat4 u_unwarp; // transposed inverse
uniform vec3 u_base;   // x: stored depth per world unit along the light, where w = 1
uniform vec3 u_slack;  // world units: rounding; rise of neighbouring facets, where w = 1, per texel along x and along y
#define GLS_LEAST_COSINE 1e-7 // edge-on receivers are unlit anyway

Receiver project_receiver(vec3 position_lv, vec3 normal_lv) {
    Receiver receiver;
    vec4 q = u_warp * vec4(position_lv, 1.0);
    float shrink = 1.0 / q.w;
    receiver.texel = q.xy * shrink;
    receiver.tangent = vec2(0.0);
    float slack = u_slack.x + max(u_slack.y * q.w, u_slack.z * q.w * q.w);
    receiver.depth = (q.z - slack * u_base.x) * shrink;
    vec3 normal = vec3(normal_lv.xy, max(normal_lv.z, GLS_LEAST_COSINE));
    vec4 plane = u_unwarp * vec4(normal, -dot(normal, position_lv));
    receiver.slope = -plane.xy / plane.z;
    return receiver;
}

bool receiver_in_front(vec3 position_lv) {
    return (u_warp * vec4(position_lv, 1.0)).w > 0.0;
}
