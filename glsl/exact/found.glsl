// Slot <between>: sample points of an area light that a receiver sees past the triangles that exact/region.glsl found. Needs
// lib/cone.glsl.
#ifndef GLS_POINT
#define GLS_POINT 0
#endif
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_RECT
#define GLS_RECT 0 // 1: a rectangular area light, which has a fixed orientation
#endif
#ifndef GLS_DITHER
#define GLS_DITHER 0 // 1: the points are rotated per pixel
#endif
#ifndef GLS_ROUNDED
#define GLS_ROUNDED 0
#endif
#ifndef GLS_MASKED
#define GLS_MASKED 0 // some casters are cut out by their texture
#endif
#ifndef GLS_POINTS
#define GLS_POINTS 0
#endif
uniform usamplerBuffer u_found;
uniform samplerBuffer u_disc; // sample points: (x, y) of rays (x, y, 1) for a directional light, else of the unit disc
uniform int u_count; // number of sample points
#if GLS_RECT
uniform mat3 u_rect; // half width, half height, emitting direction, in the light's frame
#else
uniform mat3 u_disc_axes; // of a local light, in the light's frame: right, up, axis
#endif
#if GLS_DITHER
#include "lib/gradient_noise.glsl"
#endif
float dither_turn; // 0 to 1; must be set before
const int TOGETHER = 16; // sample points tested at once
const uint ALL_HIDDEN = 0xffffffffu;

struct Disc { // of a local light, facing the receiver, or a rectangle
    vec3 right;
    vec3 up;
};

Disc disc_seen(vec3 position) { // rotated from the axis to the receiver by the shortest arc: a seam only opposite to the axis
#if GLS_RECT
    return Disc(u_rect[0], u_rect[1]);
#else
    vec3 right = u_disc_axes[0], up = u_disc_axes[1], axis = u_disc_axes[2], away = normalize(position);
    vec3 both = (axis + away) / max(1.0 + dot(axis, away), 1e-6);
    return Disc(u_radius * (right - dot(right, away) * both), u_radius * (up - dot(up, away) * both));
#endif
}

vec3 source(int k, Disc disc) { // of a ray, see Ray
    vec2 point = texelFetch(u_disc, k).xy;
#if GLS_DITHER && GLS_RECT
    point = 2.0 * fract(0.5 * point + 0.5 + dither_turn * vec2(1.0, 0.754877666)) - 1.0;
#elif GLS_DITHER
    float turn = 6.2831853 * dither_turn;
    point = vec2(cos(turn) * point.x - sin(turn) * point.y, sin(turn) * point.x + cos(turn) * point.y);
#endif
#if GLS_AT_INFINITY
    return vec3(point, 1.0);
#else
    return disc.right * point.x + disc.up * point.y;
#endif
}

void aim(inout Ray ray) {
#if !GLS_AT_INFINITY
    vec3 away = ray.position - ray.source;
    float axis = face_axis(away), s = face_side(away, axis);
    vec3 right = face_right(axis, s), up = face_up(axis, s), backward = face_backward(axis, s);
    float distance = -dot(backward, away);
    ray.right = right + dot(right, away) / distance * backward;
    ray.up = up + dot(up, away) / distance * backward;
#endif
}

bool hides(Facet other, uint mask, inout Ray ray, int k, Disc disc) {
    ray.source = source(min(k, u_count - 1), disc);
    aim(ray);
    vec3 area = turns(across(ray, other.a), across(ray, other.b), across(ray, other.c));
    bool hit = met(area) && behind(ray, other) > 0;
#if GLS_MASKED
    hit = hit && (mask == 0u || solid(int(mask) - 1, area));
#endif
    return hit;
}

// no loop: llvmpipe ends a shader after 65,536 turns of all its loops
#define HIDES(i) (hides(other, entry.z, ray, first + i * step, disc) ? 1u << uint(i) : 0u)

int seen_points(vec3 position, vec3 normal, uint list, int first, int step, ivec2 texel) { // visible among first, first + step, ...
#if GLS_DITHER
    dither_turn = gradient_noise(vec2(texel));
#endif
    Ray ray;
    ray.position = position;
    ray.bound = receiver_bound(position);
    Disc disc = disc_seen(position);
    uint open = 0u;
    for (int i = 0; i < TOGETHER; i++) {
        int k = first + i * step;
        vec3 point = source(min(k, u_count - 1), disc);
#if !GLS_AT_INFINITY
        point -= position;
#endif
        bool above = dot(normal, point) > 0.0; // above the horizon
#if GLS_ROUNDED
        above = above && dot(receiver_face, point) > 0.0;
#endif
#if GLS_POINTS
        above = above || receiver_free;
#endif
        open |= k < u_count && above ? 1u << uint(i) : 0u;
    }
    open = list == ALL_HIDDEN ? 0u : open;
    uint link = open == 0u ? 0u : list;
    while (link != 0u) {
        uvec4 entry = texelFetch(u_found, int(link) - 1);
        Facet other = facet(int(entry.x));
        uint hidden = HIDES(0) | HIDES(1) | HIDES(2) | HIDES(3) | HIDES(4) | HIDES(5) | HIDES(6) | HIDES(7) | HIDES(8) | HIDES(9)
            | HIDES(10) | HIDES(11) | HIDES(12) | HIDES(13) | HIDES(14) | HIDES(15);
        open &= ~hidden;
        link = open == 0u ? 0u : entry.y;
    }
    return bitCount(open);
}
