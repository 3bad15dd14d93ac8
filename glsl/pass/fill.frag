// One surface for each pixel from its samples, that of one that sees any, and whether one answer does not do for all (lib/mixed.glsl): because they see
// several surfaces, or one that does not go on smoothly. A sample counts as going on if its triangle's plane, where the sample's ray meets it, lies within half a pixel of the first
// one's, and its shading normal within 8 degrees (a Lambert term off by 0.14 at most).
#ifndef GLS_SURFACE
#define GLS_SURFACE 1
#endif
#ifndef GLS_ORTHO
#define GLS_ORTHO 0
#endif
#ifndef GLS_COLORS
#define GLS_COLORS 0
#endif
#ifndef GLS_COLUMNS
#define GLS_COLUMNS 2
#endif
#ifndef GLS_ROWS
#define GLS_ROWS 2
#endif
#ifndef GLS_MATERIAL
#define GLS_MATERIAL 0 // 1: the fourth channel holds a material
#endif
#ifndef GLS_EMITS
#define GLS_EMITS 0
#endif
#ifndef GLS_CAPSULES
#define GLS_CAPSULES 0 // 1: the scene has balls; 2: also tubes; all their samples are shaded
#endif
#include "lib/capsule.glsl"
#include "lib/camera_rays.glsl"
#include "lib/surface_number.glsl"
#ifndef GLS_OCTAHEDRAL
#define GLS_OCTAHEDRAL 0
#endif
#if GLS_OCTAHEDRAL
#include "lib/octahedral.glsl"
#endif
#include "lib/direction.glsl"
#include "lib/color_packing.glsl"
#include "lib/mixed.glsl"
#if GLS_MATERIAL
#include "lib/material_packing.glsl"
#endif
#if GLS_EMITS
#include "lib/emission_packing.glsl"
uniform usampler2D u_emission; // of every sample
layout(location = 2) out uint o_emission;
#endif
uniform usampler2D u_surface; // every sample
uniform sampler2D u_camera_depth;
uniform samplerBuffer u_planes; // per drawn triangle: unit world normal, distance from the scene's origin
#if GLS_COLORS == 1
uniform usamplerBuffer u_owners;
#endif
uniform vec3 u_right_l; // change of rays, or with GLS_ORTHO of their starts, per pixel; here in world axes
uniform vec3 u_up_l;
#if GLS_SURFACE == 1
layout(location = 0) out uint o_surface;
#elif GLS_SURFACE == 2
layout(location = 0) out uvec2 o_surface;
#else
layout(location = 0) out uvec4 o_surface;
#endif
layout(location = 1) out uint o_mixed;
const float SAME_NORMAL = 0.99, SAME_COLOR = 0.05;

vec3 shading_normal(uvec4 surface, vec4 plane) {
#if GLS_SURFACE > 1
    if (surface.g != 0u) return normalize(unpack_direction(surface.g));
#endif
    return plane.xyz;
}

// off: of the own plane, in pixels
bool goes_on(uvec4 own, vec4 plane, vec3 normal, uvec4 other, vec2 offset, out float off) {
    vec4 there = texelFetch(u_planes, triangle_of(other.r));
    vec3 aside = u_right_l * offset.x + u_up_l * offset.y;
#if GLS_ORTHO
    vec3 eye = v_eye_l + aside, ray = v_ray_l;
    float pixel = length(u_up_l);
#else
    vec3 eye = v_eye_l, ray = v_ray_l + aside;
#endif
    float along = (there.w - dot(there.xyz, eye)) / dot(there.xyz, ray);
#if !GLS_ORTHO
    float pixel = abs(along) * length(u_up_l);
#endif
    off = abs(dot(plane.xyz, eye + ray * along) - plane.w) / pixel;
    bool same = off <= MOST_OFF && !(GLS_CAPSULES > 0 && is_capsule(there.x)); // false where it is no number
    same = same && abs(dot(normal, shading_normal(other, there))) >= SAME_NORMAL;
#if GLS_COLORS == 1
    same = same && texelFetch(u_owners, triangle_of(own.r)).r == texelFetch(u_owners, triangle_of(other.r)).r;
#elif GLS_COLORS == 2
    same = same && all(lessThan(abs(unpack_color(own.b) - unpack_color(other.b)), vec3(SAME_COLOR)));
#endif
#if GLS_MATERIAL
    same = same && all(lessThan(abs(unpack_material(own.a) - unpack_material(other.a)), vec4(SAME_COLOR)));
#endif
    return same && (own.r & MARKS) == (other.r & MARKS); // equal flags
}

uint bits_of(bvec4 which) {
    return uint(dot(vec4(which), vec4(1.0, 2.0, 4.0, 8.0)));
}

void main() {
    const ivec2 block = ivec2(GLS_COLUMNS, GLS_ROWS);
    const int quads = GLS_COLUMNS * GLS_ROWS / 4;
    ivec2 corner = ivec2(gl_FragCoord.xy) * block, middle = corner + block / 2;
    uvec4 own = texelFetch(u_surface, middle, 0);
    vec2 texel = 1.0 / vec2(textureSize(u_surface, 0));
    uvec4 numbers[quads]; // four samples at a time, around a shared corner
    uint differing = 0u; // a bit for each sample
    for (int q = 0; q < quads; q++) {
        numbers[q] = textureGather(u_surface, vec2(corner + 1 + 2 * ivec2(q % (GLS_COLUMNS / 2), q / (GLS_COLUMNS / 2))) * texel);
        differing |= bits_of(notEqual(numbers[q], uvec4(own.r))) << uint(4 * q);
    }
    bool mixed = false;
    float most_off = 0.0;
    ivec2 seen = middle;
    vec4 plane = vec4(0.0);
    vec3 normal = vec3(0.0);
    int once = differing != 0u || GLS_CAPSULES > 0 && own.r != 0u ? 1 : 0; // loops, because llvmpipe skips nothing else
    for (int i = 0; i < once; i++) {
        plane = texelFetch(u_planes, max(triangle_of(own.r), 0));
        normal = shading_normal(own, plane);
        mixed = GLS_CAPSULES > 0 && own.r != 0u && is_capsule(plane.x);
        differing = mixed ? 0u : differing;
    }
    while (differing != 0u) { // one triangle after another
        int sample_ = findLSB(differing), q = sample_ / 4, k = sample_ % 4;
        // the order of textureGather: above left, above right, right, left
        ivec2 place = 2 * ivec2(q % (GLS_COLUMNS / 2), q / (GLS_COLUMNS / 2)) + ivec2(k == 1 || k == 2 ? 1 : 0, k < 2 ? 1 : 0);
        uvec4 other = texelFetch(u_surface, corner + place, 0);
        for (int each = 0; each < quads; each++) {
            differing &= ~(bits_of(equal(numbers[each], uvec4(other.r))) << uint(4 * each));
        }
        seen = own.r == 0u && other.r != 0u ? corner + place : seen;
        float off = 0.0;
        mixed = own.r == 0u || other.r == 0u || !goes_on(own, plane, normal, other, (vec2(place) + 0.5) / vec2(block) - 0.5, off);
#if GLS_EMITS
        vec3 light = unpack_emission(texelFetch(u_emission, middle, 0).r);
        vec3 apart = abs(light - unpack_emission(texelFetch(u_emission, corner + place, 0).r));
        mixed = mixed || any(greaterThanEqual(apart, vec3(SAME_COLOR)));
#endif
        most_off = max(most_off, off);
        differing = mixed ? 0u : differing;
    }
    own = own.r == 0u ? texelFetch(u_surface, seen, 0) : own;
#if GLS_SURFACE == 1
    o_surface = own.r;
#elif GLS_SURFACE == 2
    o_surface = own.rg;
#else
    o_surface = own;
#endif
#if GLS_EMITS
    o_emission = texelFetch(u_emission, seen, 0).r;
#endif
    o_mixed = mixed ? MIXED : mixed_of(most_off);
    gl_FragDepth = texelFetch(u_camera_depth, seen, 0).r;
}
