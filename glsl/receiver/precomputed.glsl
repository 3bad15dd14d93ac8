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
#ifndef GLS_PATTERN
// 4, 16: each pixel of a block of 2 x 2 or 4 x 4 has other sample points: means over those on the same surface; needs lib/plane_packing.glsl
#define GLS_PATTERN 0
#endif
#if GLS_PATTERN
uniform float u_pixel; // height of a pixel, for each unit of view depth
vec3 pattern_position; // set by the pass: the receiver, on its triangle
float pattern_depth; // its view depth; 1 for an orthographic camera
vec3 pattern_seen, pattern_all; // of light_visibility, for channel_visibility
const float PATTERN_COSINE = 0.9; // normals farther apart than 25 degrees are of different surfaces

#if GLS_PATTERN == 16
const int PATTERN_REACH = 2, PATTERN_WIDTH = 5, PATTERN_PERIOD = 4;
#else
const int PATTERN_REACH = 1, PATTERN_WIDTH = 3, PATTERN_PERIOD = 2;
#endif

// Sums of 3 x 3 or 5 x 5 pixels, those at the border counting half: by this each of the sets of a block counts the same.
// Pixels farther than one pixel from the receiver's plane are left out.
void add_pattern(out vec3 seen, out vec3 all) {
    seen = vec3(0.0);
    all = vec3(0.0);
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(u_counts, 0) - 1;
    vec3 normal = vec3(0.0);
    const int pixels = PATTERN_WIDTH * PATTERN_WIDTH;
    for (int i = 0; i < pixels; i++) {
        int k = (i + pixels / 2) % pixels; // the receiver's own pixel first
        ivec2 step_ = ivec2(k % PATTERN_WIDTH, k / PATTERN_WIDTH) - PATTERN_REACH, at = pixel + step_;
        // beyond the image: the neighbour on the other side that has the same set
        ivec2 other_side = at - PATTERN_PERIOD * sign(step_);
        at = ivec2(at.x < 0 || at.x > last.x ? other_side.x : at.x, at.y < 0 || at.y > last.y ? other_side.y : at.y);
        vec4 found = texelFetch(u_counts, at, 0);
#if GLS_WEIGHED == 2
        vec4 whole = texelFetch(u_unshadowed, at, 0);
        vec2 plane = vec2(found.a, whole.a);
        vec3 part = found.rgb, of = whole.rgb;
#else
        vec2 plane = found.zw;
        vec3 part = vec3(found.r), of = vec3(found.g);
#endif
        vec3 other = unpack_plane_normal(plane.y);
        normal = i == 0 ? other : normal;
        bool same = i == 0 || dot(normal, other) > PATTERN_COSINE && abs(dot(other, pattern_position) - plane.x) <= u_pixel * pattern_depth;
        float weight = same ? float((abs(step_.x) == PATTERN_REACH ? 1 : 2) * (abs(step_.y) == PATTERN_REACH ? 1 : 2)) : 0.0;
        seen += weight * part;
        all += weight * of;
    }
}
#endif

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
#if GLS_PATTERN
    vec3 seen = pattern_seen, all = pattern_all;
#else
    vec3 seen = texelFetch(u_counts, ivec2(gl_FragCoord.xy), 0).rgb, all = texelFetch(u_unshadowed, ivec2(gl_FragCoord.xy), 0).rgb;
#endif
    float sum = dot(all, LUMINANCE), mean = sum > 0.0 ? dot(seen, LUMINANCE) / sum : 0.0;
    return vec3(all.r > 0.0 ? seen.r / all.r : mean, all.g > 0.0 ? seen.g / all.g : mean, all.b > 0.0 ? seen.b / all.b : mean);
}
#endif

float light_visibility(vec3 position_lv, vec3 normal_lv, float cosine) {
#if GLS_PATTERN
    add_pattern(pattern_seen, pattern_all);
#if GLS_WEIGHED == 2
    vec2 sums = vec2(dot(pattern_seen, LUMINANCE), dot(pattern_all, LUMINANCE));
#else
    vec2 sums = vec2(pattern_seen.x, pattern_all.x);
#endif
    return sums.y > 0.0 ? sums.x / sums.y : 0.0;
#elif GLS_WEIGHED == 2
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
