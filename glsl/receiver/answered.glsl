// A surface point asked of a map: moved by <bias>, projected, made comparable, filtered.
#ifndef GLS_BOUNDED
#define GLS_BOUNDED 1 // 0: the caller knows that every receiver lies inside the map
#endif
#if GLS_BOUNDED
uniform vec4 u_tile; // first and last corner that the map answers for, texels of the atlas
#endif

float light_visibility(vec3 position_lv, vec3 normal_lv, float cosine) {
    vec3 position = biased_position(position_lv, normal_lv, cosine);
    Receiver receiver = project_receiver(position, normal_lv);
    start_depth(receiver);
#if GLS_BOUNDED
    // outside the map, and behind a spot, no caster is known: lit
    bool inside = all(greaterThanEqual(receiver.texel, u_tile.xy)) && all(lessThanEqual(receiver.texel, u_tile.zw)) && receiver_in_front(position);
    return inside ? visibility(receiver) : 1.0;
#else
    return visibility(receiver);
#endif
}
