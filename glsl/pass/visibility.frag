// Visibility of one light alone, by an exact filter. GLS_SUBPIXEL: at one point of each pixel, and a share of 1.
#ifndef GLS_SUBPIXEL
#define GLS_SUBPIXEL 0
#endif
#ifndef GLS_SELECTIVE
#define GLS_SELECTIVE 0
#endif
#include <light>
#include <shadow>
#include "lib/surface_point.glsl"
uniform usampler2D u_surface;
#if GLS_SUBPIXEL
uniform vec3 u_ray_offset; // from the pixel's middle to the point, of unit view depth
uniform float u_share;
const float SAME_SURFACE = 0.9063; // cosine of 25 degrees
#endif
noperspective in vec3 v_ray_l;
flat in vec3 v_eye_l;
flat in vec3 v_forward_l;
layout(location = 0) out vec4 o_visibility;

#if GLS_SUBPIXEL
bool pierced(Facet own, vec3 ray) {
    vec3 a = own.a - v_eye_l, b = own.b - v_eye_l, c = own.c - v_eye_l;
    vec3 side = vec3(dot(ray, cross(a, b)), dot(ray, cross(b, c)), dot(ray, cross(c, a)));
    return all(greaterThanEqual(side, vec3(0.0))) || all(lessThanEqual(side, vec3(0.0)));
}
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uint number = texelFetch(u_surface, pixel, 0).r;
    int triangle = int(number & 0x7fffffffu) - 1;
    Facet own = facet(triangle);
    vec3 ray = v_ray_l;
#if GLS_SUBPIXEL
    ray += u_ray_offset;
    // The point lies on a neighbour's triangle where that goes on smoothly; else on the plane of the pixel's own.
    Facet at = own;
    int found = triangle;
    int tries = pierced(own, ray) ? 0 : 9;
    ivec2 last = textureSize(u_surface, 0) - 1;
    for (int i = 0; i < tries; i++) {
        int other = int(texelFetch(u_surface, clamp(pixel + ivec2(i % 3 - 1, i / 3 - 1), ivec2(0), last), 0).r & 0x7fffffffu) - 1;
        Facet there = facet(max(other, 0));
        bool taken = found == triangle && other >= 0 && dot(there.normal, own.normal) > SAME_SURFACE && pierced(there, ray);
        found = taken ? other : found;
        at.a = taken ? there.a : at.a;
        at.b = taken ? there.b : at.b;
        at.c = taken ? there.c : at.c;
        at.normal = taken ? there.normal : at.normal;
    }
    own = at;
    triangle = found;
#endif
    vec3 position = surface_point(own, v_eye_l, ray, v_forward_l);
    vec3 normal = dot(own.normal, ray) > 0.0 ? -own.normal : own.normal;
    float cosine = dot(normal, light_arriving(position).xyz);
    receiver_triangle = triangle;
    receiver_corner = own.a;
    float lit = cosine > 0.0 ? light_visibility(position, normal, cosine) : 0.0;
#if GLS_SELECTIVE
    lit = number < 0x80000000u || cosine <= 0.0 ? lit : 1.0;
#endif
#if GLS_SUBPIXEL
    lit *= u_share;
#endif
    o_visibility = vec4(lit);
}
