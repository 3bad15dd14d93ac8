// Cascades of a directional light, all with one frame and one range of depth: only windows, tiles and texel sizes differ. After
// `take_cascade` as projection/orthographic.glsl.
#ifndef GLS_CASCADES
#define GLS_CASCADES 4
#endif
uniform vec4 u_cascade_texel[GLS_CASCADES]; // texel = xy * position + zw
uniform vec4 u_cascade_tile[GLS_CASCADES];  // first and last valid corner, texels of the atlas
uniform vec4 u_cascade_scale[GLS_CASCADES]; // factors of the slope along x, y; depth slack beyond the first map's; texel over the first's
uniform vec3 u_base;
#define GLS_LEAST_COSINE 1e-7 // edge-on receivers are unlit anyway

vec4 cascade_texel, cascade_tile, cascade_scale;

void take_cascade(int number) {
    cascade_texel = u_cascade_texel[0];
    cascade_tile = u_cascade_tile[0];
    cascade_scale = u_cascade_scale[0];
    for (int i = 1; i < GLS_CASCADES; i++) { // ES 1.00 allows only loop indices
        if (i == number) {
            cascade_texel = u_cascade_texel[i];
            cascade_tile = u_cascade_tile[i];
            cascade_scale = u_cascade_scale[i];
        }
    }
}

Receiver project_receiver(vec3 position_lv, vec3 normal_lv) {
    Receiver receiver;
    receiver.texel = position_lv.xy * cascade_texel.xy + cascade_texel.zw;
    receiver.tangent = vec2(0.0);
    receiver.depth = -position_lv.z * u_base.x - cascade_scale.z;
    receiver.slope = normal_lv.xy * cascade_scale.xy * (1.0 / max(normal_lv.z, GLS_LEAST_COSINE));
    return receiver;
}

bool receiver_in_front(vec3 position_lv) {
    return true;
}
