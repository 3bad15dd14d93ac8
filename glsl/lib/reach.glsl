// Attenuation of a light with distance. Range: window (1 - (d / range)^4)^2 of glTF KHR_lights_punctual; falloff: 1 / d^p.
// Twin: glshadow.lights.local
uniform vec2 u_reach; // 1 / range (0: infinite), falloff exponent p

float faded(float strength, float distance_lv) {
    float window = distance_lv * u_reach.x;
    window = max(1.0 - window * window * window * window, 0.0);
    return strength * window * window * min(pow(max(distance_lv, 1e-30), -u_reach.y), 1e18); // finite even at the light
}
