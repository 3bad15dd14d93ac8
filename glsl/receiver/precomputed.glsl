// Slot <shadow> for a light whose visibility was computed by earlier passes: the count of its visible sample points at this fragment.
#define GLS_PRECOMPUTED 1
#ifndef GLS_WEIGHED
#define GLS_WEIGHED 0 // 1: the second channel has the sum of weights; 2: sums for each channel of light, all of it in u_unshadowed
#endif
#ifndef GLS_COUNTED
#define GLS_COUNTED 0 // 1: the counts are integers
#endif
#if GLS_COUNTED
uniform usampler2D u_counts;
#else
uniform sampler2D u_counts;
#endif
#if GLS_WEIGHED == 2
uniform sampler2D u_unshadowed;
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

#if GLS_WEIGHED == 2
vec3 channel_visibility() { // of a channel that the sample points lack: that of the luminance
    vec3 seen = texelFetch(u_counts, ivec2(gl_FragCoord.xy), 0).rgb, all = texelFetch(u_unshadowed, ivec2(gl_FragCoord.xy), 0).rgb;
    float sum = dot(all, LUMINANCE), mean = sum > 0.0 ? dot(seen, LUMINANCE) / sum : 0.0;
    return vec3(all.r > 0.0 ? seen.r / all.r : mean, all.g > 0.0 ? seen.g / all.g : mean, all.b > 0.0 ? seen.b / all.b : mean);
}
#endif

float light_visibility(vec3 position_lv, vec3 normal_lv, float cosine) {
#if GLS_WEIGHED == 2
    vec2 sums = vec2(dot(texelFetch(u_counts, ivec2(gl_FragCoord.xy), 0).rgb, LUMINANCE),
                     dot(texelFetch(u_unshadowed, ivec2(gl_FragCoord.xy), 0).rgb, LUMINANCE));
    return sums.y > 0.0 ? sums.x / sums.y : 0.0;
#elif GLS_WEIGHED
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
