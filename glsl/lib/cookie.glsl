// The light's cookie: an image projected by the light. Twin: glshadow.shadows.cookie
#ifndef GLS_COOKIE
#define GLS_COOKIE 0
#endif
#if GLS_COOKIE
uniform sampler2D u_cookie;         // read as linear light
uniform mat4 u_cookie_from_lv;

vec3 cookie_at(vec3 position_lv) {
    vec4 place = u_cookie_from_lv * vec4(position_lv, 1.0);
    return GLS_TEXTURE_2D(u_cookie, place.xy / place.w).rgb; // behind a spot the cone is dark
}
#else
vec3 cookie_at(vec3 position_lv) {
    return vec3(1.0);
}
#endif
