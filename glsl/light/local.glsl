// Light from the origin of its view. Cone: smoothstep between the cosines of its angles (a point light: all 1).
// Range: window (1 - (d / range)^4)^2 of glTF KHR_lights_punctual; falloff: 1 / d^p. Twin: glshadow.core.lights.cone
uniform vec2 u_cone;  // scale, offset: x = cosine * scale + offset
uniform vec2 u_reach; // 1 / range (0: no end), falloff exponent p

vec4 light_arriving(vec3 position_lv) {
    float distance_lv = length(position_lv);
    vec3 towards = -position_lv / max(distance_lv, 1e-30);
    float x = clamp(towards.z * u_cone.x + u_cone.y, 0.0, 1.0);
    float window = distance_lv * u_reach.x;
    window = max(1.0 - window * window * window * window, 0.0);
    float strength = x * x * (3.0 - 2.0 * x) * window * window * min(pow(max(distance_lv, 1e-30), -u_reach.y), 1e18); // at the light itself: never infinite
    return vec4(towards, strength);
}
