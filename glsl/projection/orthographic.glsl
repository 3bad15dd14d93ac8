// A directional light: depth is the distance along the view, -z; on the plane N.(X - P) = 0 it rises by (Nx/Nz, Ny/Nz) per unit of (x, y).
uniform vec4 u_texel_from_lv; // texel = xy * position + zw
uniform vec3 u_base;           // depth as the map stores it = a constant + base: its factor, and that of its slope along x and y
#define GLS_LEAST_COSINE 1e-7 // edge-on receivers are unlit anyway

Receiver project_receiver(vec3 position_lv, vec3 normal_lv) {
    Receiver receiver;
    receiver.texel = position_lv.xy * u_texel_from_lv.xy + u_texel_from_lv.zw;
    receiver.tangent = vec2(0.0);
    receiver.depth = -position_lv.z * u_base.x;
    receiver.slope = normal_lv.xy * u_base.yz * (1.0 / max(normal_lv.z, GLS_LEAST_COSINE));
    return receiver;
}

bool receiver_in_front(vec3 position_lv) {
    return true;
}
