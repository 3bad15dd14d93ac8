// Transmittance of translucent casters: layers of their colours and depths, the nearest to the light first. A layer tints what lies behind
// it; the last one holds all that is behind the others. The receiver is offset by two texels along its normal, so that a caster does not tint
// itself; four texels are sampled bilinearly.
#ifndef GLS_TINT
#define GLS_TINT 0 // number of views
#endif
#ifndef GLS_TINT_LAYERS
#define GLS_TINT_LAYERS 1
#endif
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#if GLS_TINT
uniform sampler2D u_tint;       // linear colours, and window depth; 1 where there is nothing
uniform vec2 u_tint_size;       // 1 / texels of it
uniform float u_tint_layer;     // texels from a layer to the next, which is above it
uniform mat4 u_tint_from_lv[GLS_TINT]; // to texels and window depth, homogeneous
uniform vec4 u_tint_tile[GLS_TINT];    // first and last texel
uniform float u_tint_texel;     // size of a texel in world units; of a local light at distance 1

vec3 tinted(vec2 texel, float depth) {
    vec3 through = vec3(1.0);
    for (int i = 0; i < GLS_TINT_LAYERS; i++) {
        vec2 middle = (texel + vec2(0.5, 0.5 + float(i) * u_tint_layer)) * u_tint_size;
        vec4 layer = GLS_TEXTURE_2D(u_tint, middle);
        through *= depth > layer.a ? layer.rgb : vec3(1.0);
    }
    return through;
}

vec3 transmitted(vec3 position_lv, vec3 normal_lv) {
#if GLS_AT_INFINITY
    vec3 place = position_lv + normal_lv * (2.0 * u_tint_texel);
#else
    vec3 place = position_lv + normal_lv * (2.0 * u_tint_texel * length(position_lv));
#endif
    vec3 through = vec3(1.0);
    for (int i = 0; i < GLS_TINT; i++) {
        vec4 q = u_tint_from_lv[i] * vec4(place, 1.0);
        vec2 texel = q.xy / q.w - 0.5;
        float depth = q.z / q.w;
        if (q.w > 0.0 && all(greaterThanEqual(texel, u_tint_tile[i].xy)) && all(lessThanEqual(texel, u_tint_tile[i].zw - 1.0))) {
            vec2 base = floor(texel);
            vec2 f = texel - floor(texel);
            vec3 low = mix(tinted(base, depth), tinted(base + vec2(1.0, 0.0), depth), f.x);
            vec3 high = mix(tinted(base + vec2(0.0, 1.0), depth), tinted(base + vec2(1.0, 1.0), depth), f.x);
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
