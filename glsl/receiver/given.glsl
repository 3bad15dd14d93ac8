// Slot <shadow> for a light whose visibility earlier passes found, where this pass draws: a count of the points of the light that are seen.
uniform sampler2D u_given;
uniform float u_points; // of the light

float light_visibility(vec3 position_lv, vec3 normal_lv, float cosine) {
    return texelFetch(u_given, ivec2(gl_FragCoord.xy), 0).r / u_points;
}
