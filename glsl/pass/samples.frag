// Visibility of one light, by an exact filter, at one point of a collected pixel.
#ifndef GLS_COLUMNS
#define GLS_COLUMNS 4 // of a block: points of one pixel
#endif
#ifndef GLS_ROWS
#define GLS_ROWS 4
#endif
#ifndef GLS_ORTHO
#define GLS_ORTHO 0 // 1: an orthographic camera
#endif
#include "lib/surface_number.glsl"
#include <light>
#include <shadow>
#include "lib/asked.glsl"
#include "lib/surface_point.glsl"
uniform usamplerBuffer u_pixels; // x, y << 16
uniform usampler2D u_surface;
uniform ivec2 u_size;
uniform vec2 u_offsets[GLS_COLUMNS * GLS_ROWS]; // of the points from the pixel's middle, pixels
flat in mat3 v_ray_from_ndc; // u_ray_l: see resolve.vert
flat in vec3 v_eye_l;
flat in vec3 v_forward_l;
flat in int v_count; // collected pixels
layout(location = 0) out float o_visibility;
const float SAME_SURFACE = 0.9063; // cosine of 25 degrees

bool pierced(Facet own, vec3 eye, vec3 ray) {
    vec3 a = own.a - eye, b = own.b - eye, c = own.c - eye;
    vec3 side = vec3(dot(ray, cross(a, b)), dot(ray, cross(b, c)), dot(ray, cross(c, a)));
    return all(greaterThanEqual(side, vec3(0.0))) || all(lessThanEqual(side, vec3(0.0)));
}

void main() {
    ivec2 fragment = ivec2(gl_FragCoord.xy);
    ivec2 block = fragment / ivec2(GLS_COLUMNS, GLS_ROWS), point = fragment % ivec2(GLS_COLUMNS, GLS_ROWS);
    int place = block.y * u_size.x + block.x;
    bool asked = place < v_count;
    uint bits = texelFetch(u_pixels, asked ? place : 0).r;
    ivec2 pixel = ivec2(int(bits & 0xffffu), int(bits >> 16u));
    uint number = texelFetch(u_surface, pixel, 0).r;
    int triangle = triangle_of(number);
    vec2 offset = u_offsets[point.y * GLS_COLUMNS + point.x];
    vec3 through = v_ray_from_ndc * vec3((vec2(pixel) + 0.5 + offset) * 2.0 / vec2(u_size) - 1.0, 1.0);
#if GLS_ORTHO
    vec3 eye = v_eye_l + through, ray = v_forward_l;
#else
    vec3 eye = v_eye_l, ray = through;
#endif
    // The point lies on a neighbour's triangle where the surface goes on smoothly; else on the plane of the pixel's own.
    Facet own = facet(max(triangle, 0)), at = own;
    int found = triangle, tries = asked && !pierced(own, eye, ray) ? 3 : 0;
    ivec2 towards = ivec2(sign(offset)); // the pixels beside, above and across that the point is nearest to
    for (int i = 1; i <= tries; i++) {
        ivec2 texel = clamp(pixel + towards * ivec2(i & 1, i >> 1), ivec2(0), u_size - 1);
        int other = triangle_of(texelFetch(u_surface, texel, 0).r);
        Facet there = facet(max(other, 0));
        bool taken = found == triangle && other >= 0 && dot(there.normal, own.normal) > SAME_SURFACE && pierced(there, eye, ray);
        found = taken ? other : found;
        at.a = taken ? there.a : at.a;
        at.b = taken ? there.b : at.b;
        at.c = taken ? there.c : at.c;
        at.normal = taken ? there.normal : at.normal;
    }
    vec3 position = surface_point(found, at, eye, ray, v_forward_l);
    vec3 normal = dot(at.normal, ray) > 0.0 ? -at.normal : at.normal;
    float cosine = asked ? dot(normal, light_arriving(position).xyz) : 0.0;
    receiver_triangle = found;
    receiver_corner = plane_corner(at);
    o_visibility = asked_visibility(number, position, normal, cosine);
}
