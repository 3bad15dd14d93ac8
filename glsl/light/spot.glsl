// Slot <light>: light from the origin of its view, in a cone about -z: smoothstep between the cosines of its angles. Twin: glshadow.lights.spot
uniform vec2 u_cone; // scale, offset: x = cosine * scale + offset
#include "lib/reach.glsl"

vec4 light_arriving(vec3 position_lv) {
    float distance_lv = length(position_lv);
    vec3 towards = -position_lv / max(distance_lv, 1e-30);
    float x = clamp(towards.z * u_cone.x + u_cone.y, 0.0, 1.0);
    return vec4(towards, faded(x * x * (3.0 - 2.0 * x), distance_lv));
}

bool light_shines_on(vec3 position_lv) {
    return (-position_lv / max(length(position_lv), 1e-30)).z * u_cone.x + u_cone.y >= 0.0;
}
