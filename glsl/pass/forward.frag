// Forward shading with one light. More lights: add the results, with u_ambient = 0 in all but one.
#ifndef GLS_DERIVATIVES
#define GLS_DERIVATIVES 0 // 1: the face normal from screen derivatives
#endif
#ifndef GLS_OUTPUT
#define GLS_OUTPUT 0 // 0 visibility in all channels, 1 linear light, 2 sRGB, tone mapped with GLS_TONE
#endif
#include <light>
#include <shadow>
#if GLS_DERIVATIVES
#include "bias/receiver_plane_derivatives.glsl"
#else
GLS_VARYING vec3 v_normal_lv;
#endif
#if GLS_OUTPUT == 2
#include "lib/srgb.glsl"
#include "lib/tone.glsl"
#endif
#include "lib/cookie.glsl"
#include "lib/tint.glsl"
GLS_VARYING vec3 v_position_lv;
uniform vec4 u_eye_lv; // the eye (w = 1), or the direction to it (w = 0: orthographic camera)
#if GLS_OUTPUT
uniform vec3 u_radiance; // color * intensity
uniform vec3 u_ambient;
uniform vec3 u_color; // base colour, linear
uniform float u_strength;
#endif
#if GLS_CORE
layout(location = 0) out vec4 o_color;
#else
#define o_color gl_FragColor
#endif

void main() {
#if GLS_DERIVATIVES
    vec3 normal = normal_from_derivatives(v_position_lv);
#else
    vec3 normal = normalize(v_normal_lv);
#endif
    if (dot(normal, v_position_lv * u_eye_lv.w - u_eye_lv.xyz) > 0.0) normal = -normal; // face the eye
    vec4 arriving = light_arriving(v_position_lv);
    float cosine = dot(normal, arriving.xyz);
    float lit = cosine > 0.0 && light_shines_on(v_position_lv) ? light_visibility(v_position_lv, normal, cosine) : 0.0;
#if GLS_OUTPUT
    vec3 radiance = u_radiance * cookie_at(v_position_lv) * transmitted(v_position_lv, normal);
    vec3 sum = u_color * (u_ambient + radiance * (max(cosine, 0.0) * arriving.w * mix(1.0, lit, u_strength)));
#if GLS_OUTPUT == 2
    sum = srgb(clamp(toned(exposed(sum)), 0.0, 1.0));
#endif
    o_color = vec4(sum, 1.0);
#else
    o_color = vec4(lit);
#endif
}
