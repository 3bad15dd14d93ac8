// Moves the receiver along its normal N, in the axes of the map, by u_bias * length(N.x * texel width, N.y * texel height): for square
// texels u_bias texels * sin(angle to a directional light); for a local light at least the same by the angle to it. Holbert 2011.
// Twin: glshadow.shadows.bias.NormalOffsetBias
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_CASCADES
#define GLS_CASCADES 0
#endif
uniform float u_bias; // texels

vec3 biased_position(vec3 position_lv, vec3 normal_lv, float cosine) {
#if GLS_CASCADES
    return position_lv + normal_lv * (u_bias * length(normal_lv.xy / cascade_texel.xy));
#elif GLS_AT_INFINITY
    return position_lv + normal_lv * (u_bias * length(normal_lv.xy / u_texel_from_lv.xy));
#else
    float depth = max(-map_axes(position_lv, position_lv).z, 0.0);
    float lean = length(map_axes(normal_lv, position_lv).xy / u_texel_from_lv.xy);
    lean = max(lean, sqrt(max(0.0, 1.0 - cosine * cosine)) / min(u_texel_from_lv.x, u_texel_from_lv.y));
    return position_lv + normal_lv * (u_bias * lean * depth);
#endif
}
