// Visibility of a surface point from one of several maps: the first that covers it, or (GLS_BY_DEPTH) that of its slice of depth. Near the
// end of a map the next one is blended in.
#ifndef GLS_MIP_LEVELS
#define GLS_MIP_LEVELS 0
#endif
#ifndef GLS_BY_DEPTH
#define GLS_BY_DEPTH 0
#endif
#ifndef GLS_CASCADES
#define GLS_CASCADES 4
#endif
uniform float u_blend; // share of a map's half width, or of a slice, over which maps are blended
#if GLS_BY_DEPTH
uniform vec2 u_cascade_end[GLS_CASCADES]; // start and end of slices
uniform vec4 u_view_depth; // dot with (position, 1): the camera's view depth
#endif

// Distance in texels from the nearest border of a map's valid tile; negative outside.
float inset(vec2 texel, vec4 tile) {
    vec2 away = min(texel - tile.xy, tile.zw - texel);
    return min(away.x, away.y);
}

float light_visibility(vec3 position_lv, vec3 normal_lv, float cosine) {
#if GLS_MIP_LEVELS
    start_footprint(position_lv, normal_lv);
#endif
    int chosen = GLS_CASCADES; // none: no map covers the point
    float weight = 1.0;
#if GLS_BY_DEPTH
    float depth = dot(u_view_depth, vec4(position_lv, 1.0));
#endif
    for (int j = 0; j < GLS_CASCADES; j++) {
        int i = GLS_CASCADES - 1 - j;
#if GLS_BY_DEPTH
        vec2 ends = u_cascade_end[GLS_CASCADES - 1 - j];
        bool mine = depth <= ends.y || i == GLS_CASCADES - 1;
        float share = (ends.y - depth) / max(u_blend * (ends.y - ends.x), 1e-30);
#else
        vec4 tile = u_cascade_tile[GLS_CASCADES - 1 - j], line = u_cascade_texel[GLS_CASCADES - 1 - j];
        float inside_by = inset(position_lv.xy * line.xy + line.zw, tile);
        bool mine = inside_by >= 0.0;
        float share = inside_by / max(u_blend * 0.5 * (tile.z - tile.x), 1e-30);
#endif
        chosen = mine ? i : chosen;
        weight = mine ? (i < GLS_CASCADES - 1 ? clamp(share, 0.0, 1.0) : 1.0) : weight;
    }
    float lit = 1.0;
#if GLS_CORE
    int turns = weight < 1.0 && chosen < GLS_CASCADES - 1 ? 2 : 1; // a loop, because llvmpipe does not skip branches
    for (int j = 0; j < turns; j++) {
#else
    for (int j = 0; j < 2; j++) {
        if (j == 1 && (weight >= 1.0 || chosen >= GLS_CASCADES - 1)) break;
#endif
        take_cascade(chosen + j < GLS_CASCADES ? chosen + j : GLS_CASCADES - 1);
        vec3 position = biased_position(position_lv, normal_lv, cosine);
        Receiver receiver = project_receiver(position, normal_lv);
        start_depth(receiver);
#if GLS_MIP_LEVELS
        take_level(receiver, position, normal_lv);
#endif
        bool inside = chosen < GLS_CASCADES && inset(receiver.texel, cascade_tile) >= 0.0;
        float found = inside ? visibility(receiver) : 1.0;
        lit = j == 0 ? found : inside ? found + weight * (lit - found) : lit;
    }
    return lit;
}
