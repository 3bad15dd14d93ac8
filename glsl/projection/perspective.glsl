// A spot light: the ray (x, y, -1) hits the plane N.(X - P) = 0 at depth z with 1/z = (Nx x + Ny y - Nz) / N.P, affine in the map.
uniform vec4 u_texel_from_lv; // texel = xy * tangent + zw
uniform vec3 u_base;           // depth as the map stores it = a constant + base: its factor, and that of its slope along x and y
uniform vec2 u_allowance;     // reduction of a receiver's distance: world units, and a share of the distance
#define GLS_LEAST_COSINE 1e-7 // edge-on receivers are unlit anyway

vec3 map_axes(vec3 v, vec3 position_lv) {
    return v;
}

Receiver project_receiver(vec3 position_lv, vec3 normal_lv) {
    Receiver receiver;
    receiver.depth = u_base.x / max(-position_lv.z * (1.0 - u_allowance.y) - u_allowance.x, 1e-30);
    receiver.tangent = position_lv.xy / -position_lv.z;
    receiver.texel = receiver.tangent * u_texel_from_lv.xy + u_texel_from_lv.zw;
    float plane = -max(-dot(normal_lv, position_lv), GLS_LEAST_COSINE * length(position_lv));
    receiver.slope = normal_lv.xy * u_base.yz * (1.0 / plane);
    return receiver;
}

bool receiver_in_front(vec3 position_lv) {
    return position_lv.z < 0.0;
}
