// Slot <light>: light from the origin of its view in every direction. Twin: glshadow.lights.point
#include "lib/reach.glsl"

vec4 light_arriving(vec3 position_lv) {
    float distance_lv = length(position_lv);
    return vec4(-position_lv / max(distance_lv, 1e-30), faded(1.0, distance_lv));
}

bool light_shines_on(vec3 position_lv) {
    return true;
}
