// Mip level of the map whose texels have the size of a pixel, from the positions of the neighbouring pixels on the receiver's plane; the
// finest level if they see another surface or nothing. Needs <projection>; derivatives are taken where all neighbours execute.
#ifndef GLS_MIP_LEVELS
#define GLS_MIP_LEVELS 0
#endif
#if GLS_MIP_LEVELS
#define GLS_OFF_PLANE 0.1 // sine above which a neighbour lies on another surface
vec3 pixel_right, pixel_up; // to the neighbours

float on_plane(vec3 along, vec3 normal_lv) { // 0 also for NaN, which the background produces
    return abs(dot(along, normal_lv)) <= GLS_OFF_PLANE * length(along) ? 1.0 : 0.0;
}

void start_footprint(vec3 position_lv, vec3 normal_lv) {
    pixel_right = dFdx(position_lv);
    pixel_up = dFdy(position_lv);
    bool flat_ = on_plane(pixel_right, normal_lv) * on_plane(pixel_up, normal_lv) > 0.0;
    pixel_right = flat_ ? pixel_right : vec3(0.0);
    pixel_up = flat_ ? pixel_up : vec3(0.0);
}

void take_level(inout Receiver receiver, vec3 position_lv, vec3 normal_lv) {
    vec2 right = project_receiver(position_lv + pixel_right, normal_lv).texel - receiver.texel;
    vec2 up = project_receiver(position_lv + pixel_up, normal_lv).texel - receiver.texel;
    float area = abs(right.x * up.y - right.y * up.x);
    receiver.level = clamp(0.5 * log2(max(area, 1.0)), 0.0, float(GLS_MIP_LEVELS));
}
#endif
