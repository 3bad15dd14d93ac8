// Visibility of a surface point from a single map: moved by <bias>, projected, made comparable, filtered.
#ifndef GLS_MIP_LEVELS
#define GLS_MIP_LEVELS 0
#endif
#ifndef GLS_BOUNDED
#define GLS_BOUNDED 1 // 0: every receiver is known to be inside the map
#endif
#ifndef GLS_FALLOFF
#define GLS_FALLOFF 0 // 1: shadows fade towards the map's border, as Babylon.js's frustumEdgeFalloff does
#endif
#if GLS_FALLOFF
uniform float u_falloff; // share of the squared distance from the map's centre to its sides
#endif
#if GLS_BOUNDED
uniform vec4 u_tile; // first and last valid corner, texels of the atlas
#endif

float light_visibility(vec3 position_lv, vec3 normal_lv, float cosine) {
#if GLS_MIP_LEVELS
    start_footprint(position_lv, normal_lv);
#endif
    vec3 position = biased_position(position_lv, normal_lv, cosine);
    Receiver receiver = project_receiver(position, normal_lv);
    start_depth(receiver);
#if GLS_MIP_LEVELS
    take_level(receiver, position, normal_lv);
#endif
#if GLS_BOUNDED
    // lit outside the map and behind a spot, where the map has no casters
    bool inside = all(greaterThanEqual(receiver.texel, u_tile.xy)) && all(lessThanEqual(receiver.texel, u_tile.zw)) && receiver_in_front(position);
#if GLS_FALLOFF
    vec2 place = (receiver.texel - 0.5 * (u_tile.xy + u_tile.zw)) / (0.5 * (u_tile.zw - u_tile.xy));
    float fade = smoothstep(1.0 - u_falloff, 1.00000012, clamp(dot(place, place), 0.0, 1.0));
    return inside ? mix(visibility(receiver), 1.0, fade) : 1.0;
#else
    return inside ? visibility(receiver) : 1.0;
#endif
#else
    return visibility(receiver);
#endif
}
