// Slot <shadow> for a light whose visibility was found before, pixel by pixel.
uniform sampler2D u_given;

float light_visibility(vec3 position_lv, vec3 normal_lv, float cosine) {
    return texelFetch(u_given, ivec2(gl_FragCoord.xy), 0).r;
}
