// Slot <shadow> for a light whose visibility was computed by earlier passes: the count of its visible sample points at this fragment.
#define GLS_PRECOMPUTED 1
#ifndef GLS_WEIGHED
#define GLS_WEIGHED 0 // 1: the second channel has the sum of weights
#endif
#ifndef GLS_COUNTED
#define GLS_COUNTED 0 // 1: the counts are integers
#endif
#if GLS_COUNTED
uniform usampler2D u_counts;
#else
uniform sampler2D u_counts;
#endif
uniform float u_points; // sample points of the light

#ifndef GLS_MARKS
#define GLS_MARKS 0 // 1: the highest bit marks pixels whose samples may see the light differently
#endif
#if GLS_MARKS
bool samples_differ(PixelFootprint pixel, float cosine, float lit) {
    return texelFetch(u_counts, ivec2(gl_FragCoord.xy), 0).r >= 0x80000000u;
}
#endif

float light_visibility(vec3 position_lv, vec3 normal_lv, float cosine) {
#if GLS_WEIGHED
    vec2 sums = texelFetch(u_counts, ivec2(gl_FragCoord.xy), 0).rg;
    return sums.y > 0.0 ? sums.x / sums.y : 0.0;
#else
#if GLS_COUNTED
    return float(texelFetch(u_counts, ivec2(gl_FragCoord.xy), 0).r & 0x7fffffffu) / u_points;
#else
    return texelFetch(u_counts, ivec2(gl_FragCoord.xy), 0).r / u_points;
#endif
#endif
}
