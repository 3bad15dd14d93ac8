// Moves the receiver towards the light by u_bias world units. A directional light is along +z; a local light is at the origin.
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
uniform float u_bias;

vec3 biased_position(vec3 position_lv, vec3 normal_lv, float cosine) {
#if GLS_AT_INFINITY
    return position_lv + vec3(0.0, 0.0, u_bias);
#else
    return position_lv * (1.0 - min(u_bias / length(position_lv), 0.999)); // never past the light
#endif
}
