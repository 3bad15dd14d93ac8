// The receiver moved along its normal by u_bias texels * sin(angle to the light). Holbert 2011.
#ifndef GLS_SUN
#define GLS_SUN 0
#endif
#ifndef GLS_CASCADES
#define GLS_CASCADES 0
#endif
uniform float u_bias; // a sun: world units; else world units at distance 1 along the light's axis

vec3 biased_position(vec3 position_lv, vec3 normal_lv, float cosine) {
    float sine = sqrt(max(0.0, 1.0 - cosine * cosine));
#if GLS_CASCADES
    return position_lv + normal_lv * (u_bias * cascade_scale.w * sine); // of the first map's texels
#elif GLS_SUN
    return position_lv + normal_lv * (u_bias * sine);
#else
    vec3 size = abs(position_lv);
    return position_lv + normal_lv * (u_bias * sine * max(size.x, max(size.y, size.z)));
#endif
}
