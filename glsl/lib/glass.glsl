// What arrives of a light through casters that blend: a map of its colours, and one of the nearest of them, before which nothing is tinted.
// The receiver is moved off its surface by two texels, so that a pane does not tint itself; four texels are asked and weighed bilinearly.
#ifndef GLS_GLASS
#define GLS_GLASS 0 // views
#endif
#ifndef GLS_SUN
#define GLS_SUN 0
#endif
#if GLS_GLASS
uniform sampler2D u_glass;       // linear colours, 1 where there is nothing
uniform sampler2D u_glass_depth; // window depth of the nearest, 1 where there is nothing
uniform mat4 u_glass_from_lv[GLS_GLASS]; // to texels and window depth, homogeneous
uniform vec4 u_glass_tile[GLS_GLASS];    // first and last texel
uniform float u_glass_texel;     // world units of a sun's texel; else at distance 1

vec3 tinted(ivec2 texel, float depth) {
    return depth > texelFetch(u_glass_depth, texel, 0).r ? texelFetch(u_glass, texel, 0).rgb : vec3(1.0);
}

vec3 transmitted(vec3 position_lv, vec3 normal_lv) {
#if GLS_SUN
    vec3 place = position_lv + normal_lv * (2.0 * u_glass_texel);
#else
    vec3 place = position_lv + normal_lv * (2.0 * u_glass_texel * length(position_lv));
#endif
    vec3 through = vec3(1.0);
    for (int i = 0; i < GLS_GLASS; i++) {
        vec4 q = u_glass_from_lv[i] * vec4(place, 1.0);
        vec2 texel = q.xy / q.w - 0.5;
        float depth = q.z / q.w;
        if (q.w > 0.0 && all(greaterThanEqual(texel, u_glass_tile[i].xy)) && all(lessThanEqual(texel, u_glass_tile[i].zw - 1.0))) {
            ivec2 base = ivec2(floor(texel));
            vec2 f = texel - floor(texel);
            vec3 low = mix(tinted(base, depth), tinted(base + ivec2(1, 0), depth), f.x);
            vec3 high = mix(tinted(base + ivec2(0, 1), depth), tinted(base + ivec2(1, 1), depth), f.x);
            through = mix(low, high, f.y);
        }
    }
    return through;
}
#else
vec3 transmitted(vec3 position_lv, vec3 normal_lv) {
    return vec3(1.0);
}
#endif
