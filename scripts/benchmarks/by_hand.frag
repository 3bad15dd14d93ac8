#version 330 core
#extension GL_ARB_texture_gather : require
// The resolve pass for one sun on one surface, its kernel written into it: what the composed one is compared with.
// KERNEL: 0 one texel; 1 box of R; 2 bell of R = 2; 3 spiral of 16 taps, radius 2; 4 Chebyshev
flat in vec2 v_unproject; flat in vec3 v_lv_from_l; flat in vec3 v_forward_l; flat in mat3 v_axes_l; flat in vec3 v_towards_w;
flat in vec3 v_radiance; flat in vec3 v_ambient; flat in vec3 v_ambient_below;
noperspective in vec3 v_ray_l; flat in vec3 v_eye_l;
uniform usampler2D u_surface; uniform sampler2D u_camera_depth; uniform samplerBuffer u_planes;
uniform sampler2D u_map; uniform vec2 u_map_texel; uniform vec4 u_texel_from_lv; uniform vec3 u_base; uniform DEPTH u_depth;
layout(location = 0) out vec4 o_color;

vec3 srgb(vec3 c) {
    vec3 a = sqrt(c), b = sqrt(a);
    return mix(12.92 * c, 0.65391315 * a + 0.68888055 * b - 0.31861524 * sqrt(b) - 0.02017613 * c - 0.00403397, step(vec3(0.0031308), c));
}
vec2 g_texel, g_slope; float g_depth;
vec4 four(vec2 corner) {
    float reference = min(g_depth + dot(g_slope, corner - g_texel), 1.0);
    return step(vec4(reference), textureGather(u_map, corner * u_map_texel));
}
float kernel() {
#if KERNEL == 0
    return step(min(g_depth, 1.0), texelFetch(u_map, ivec2(g_texel), 0).r);
#elif KERNEL == 1 || KERNEL == 2
    vec2 base = floor(g_texel - 0.5), f = g_texel - 0.5 - base, first = base + (1.0 - float(R));
    float sum = 0.0;
    for (int j = 0; j <= R; j++) for (int i = 0; i <= R; i++) {
        vec4 lit = four(first + 2.0 * vec2(i, j));
#if KERNEL == 1
        vec2 x = vec2(i == 0 ? 1.0 - f.x : 1.0, i == R ? f.x : 1.0), y = vec2(j == 0 ? 1.0 - f.y : 1.0, j == R ? f.y : 1.0);
#else
        const float bell[8] = float[8](0.0, 1.0, 3.0, 4.0, 3.0, 1.0, 0.0, 0.0);
        vec2 x = vec2(mix(bell[2 * i + 1], bell[2 * i], f.x), mix(bell[2 * i + 2], bell[2 * i + 1], f.x));
        vec2 y = vec2(mix(bell[2 * j + 1], bell[2 * j], f.y), mix(bell[2 * j + 2], bell[2 * j + 1], f.y));
#endif
        sum += y.x * (lit.w * x.x + lit.z * x.y) + y.y * (lit.x * x.x + lit.y * x.y);
    }
    return min(sum / SUM, 1.0);
#elif KERNEL == 3
    float sum = 0.0;
    for (int i = 0; i < 16; i++) {
        float angle = float(i) * 2.3999632;
        vec2 place = g_texel + 2.0 * vec2(cos(angle), sin(angle)) * sqrt((float(i) + 0.5) / 16.0) - 0.5, base = floor(place), f = place - base;
        vec4 lit = four(base + 1.0);
        vec2 row = mix(lit.wz, lit.xy, f.y);
        sum += mix(row.x, row.y, f.x);
    }
    return min(sum / 16.0, 1.0);
#else
    vec2 m = textureLod(u_map, g_texel * u_map_texel, 0.0).xy;
    float beyond = 2.0 * g_depth - 1.0 - m.x, variance = max(m.y - m.x * m.x, 2.4e-7);
    return beyond <= 0.0 ? 1.0 : variance / (variance + beyond * beyond);
#endif
}
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 plane = texelFetch(u_planes, int(texelFetch(u_surface, pixel, 0).r & 0x3fffffffu) - 1);
    vec3 normal = v_axes_l * plane.xyz;
    vec3 position = v_eye_l + v_ray_l * (1.0 / (v_unproject.x + v_unproject.y * texelFetch(u_camera_depth, pixel, 0).r));
    position += normal * (plane.w - dot(normal, position)) + v_lv_from_l;
    float side = dot(normal, v_ray_l) > 0.0 ? -1.0 : 1.0;
    normal *= side;
    g_texel = position.xy * u_texel_from_lv.xy + u_texel_from_lv.zw;
    g_slope = normal.xy * u_base.yz / max(normal.z, 1e-7);
#if KERNEL == 4
    g_depth = -position.z * u_base.x + u_depth.x;
#else
    g_depth = -position.z * u_base.x + u_depth - SLACK * (abs(g_slope.x) + abs(g_slope.y));
#endif
    float lit = normal.z > 0.0 ? kernel() : 0.0;
    vec3 sum = mix(v_ambient_below, v_ambient, 0.5 + 0.5 * side * plane.y) + v_radiance * (max(normal.z, 0.0) * lit);
    o_color = vec4(srgb(clamp(sum, 0.0, 1.0)), 1.0);
}
