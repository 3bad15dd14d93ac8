// Shades every visible surface with one light: position from depth, normal from the triangle, visibility from <shadow>, Lambert's law and,
// where the scene has materials that are not matte, GGX.
// All in the light's axes. GLS_FIRST: adds the ambient term, else the result of earlier lights. GLS_LAST: writes the display image, else
// the sum so far. GLS_PER_SAMPLE: shades samples of collected pixels, with lights blended additively.
#ifndef GLS_SURFACE
#define GLS_SURFACE 1
#endif
#ifndef GLS_COLORS
#define GLS_COLORS 0 // base colour: 0 one for all, 1 per node, 2 per pixel (textures; needs 4 channels)
#endif
#ifndef GLS_ORTHO
#define GLS_ORTHO 0 // 1: an orthographic camera
#endif
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
#ifndef GLS_FIRST
#define GLS_FIRST 1
#endif
#ifndef GLS_LAST
#define GLS_LAST 1
#endif
#ifndef GLS_HEMISPHERE
#define GLS_HEMISPHERE 0 // 1: the ambient term differs from above and below, blended by the normal's height
#endif
#ifndef GLS_WEAK
#define GLS_WEAK 0 // 1: a shadow removes a share u_strength of the light, not all of it
#endif
#ifndef GLS_VISIBILITY
#define GLS_VISIBILITY 1 // 1: also writes the light's visibility
#endif
#ifndef GLS_SUM
#define GLS_SUM 0 // 1: also writes the linear sum
#endif
#ifndef GLS_EXACT
#define GLS_EXACT 0 // 1: <shadow> is receiver/exact.glsl, and the receiver is where the ray hits its triangle
#endif
#ifndef GLS_PER_SAMPLE
#define GLS_PER_SAMPLE 0
#endif
#ifndef GLS_CATCHES
#define GLS_CATCHES 0
#endif
#ifndef GLS_SELECTIVE
#define GLS_SELECTIVE 0 // 1: some triangles receive no shadows
#endif
#ifndef GLS_MARKS
#define GLS_MARKS 0 // 1: marks pixels whose samples may see the light differently, by 2 on top of the visibility
#endif
#ifndef GLS_TINT
#define GLS_TINT 0 // number of views of the map of translucent casters
#endif
#ifndef GLS_COOKIE
#define GLS_COOKIE 0 // 1: the light projects an image
#endif
#ifndef GLS_ROUNDED
#define GLS_ROUNDED 0 // 1: some triangles are shaded as smooth surfaces, see lib/smooth_point.glsl
#endif
#ifndef GLS_CAPSULES
#define GLS_CAPSULES 0 // 1: the scene has balls; 2: also tubes
#endif
#ifndef GLS_ALONE
#define GLS_ALONE 0 // 1: writes only the visibility; 2: the same as an image shows, 0 where the light does not shine, whatever GLS_WEIGHED is
#endif
#ifndef GLS_POINTS
#define GLS_POINTS 0 // 1, 2, with GLS_ALONE: receivers are given as points, see lib/given_point.glsl
#endif
#ifndef GLS_DIRECTIONS
#define GLS_DIRECTIONS 0 // with GLS_ALONE: writes the sums of lib/directionmaps.glsl, and the surface's plane
#endif
#ifndef GLS_PATTERN
#define GLS_PATTERN 0 // 4, 16: <shadow> is receiver/precomputed.glsl, and takes means over neighbouring pixels
#endif
#ifndef GLS_MATERIAL
#define GLS_MATERIAL 0 // 1: the surface buffer's fourth channel holds a material
#endif
#ifndef GLS_GLOSSY
#define GLS_GLOSSY 0 // 1: some are neither matte nor rough
#endif
#ifndef GLS_ROUGH
#define GLS_ROUGH 0 // 1: none is, and some are rough: not metallic, of roughness 1
#endif
#ifndef GLS_OCCLUDED
#define GLS_OCCLUDED 0 // 1: some have an occlusion map
#endif
#ifndef GLS_EMITS
#define GLS_EMITS 0 // 1: some emit light, which the first light's pass adds
#endif
#ifndef GLS_BUMPED
#define GLS_BUMPED 0 // 1: some have a normal map
#endif
#ifndef GLS_METERED
#define GLS_METERED 0 // 1: emission is in units of u_white, the light that is shown as white
#endif
#include "lib/camera_rays.glsl"
#if GLS_PER_SAMPLE
#include "lib/per_sample.glsl"
#include "lib/sample_ray.glsl"
#endif
#include "lib/finish.glsl"
#ifndef GLS_OCTAHEDRAL
#define GLS_OCTAHEDRAL 0
#endif
#if GLS_OCTAHEDRAL || GLS_ROUNDED
#include "lib/octahedral.glsl"
#endif
#include "lib/direction.glsl"
#include "lib/color_packing.glsl"
#include "lib/srgb.glsl"
#include "lib/tone.glsl"
#include "lib/surface_number.glsl"
#if GLS_MARKS
#include "lib/pixel_footprint.glsl"
#endif
#if GLS_CAPSULES
#include "lib/capsule.glsl"
#endif
#if GLS_DIRECTIONS || GLS_PATTERN
#include "lib/plane_packing.glsl"
#endif
#if GLS_POINTS
#include "lib/given_point.glsl"
#endif
#include <light>
#include <shadow>
#include "lib/visibility.glsl"
#include "lib/cookie.glsl"
#include "lib/tint.glsl"
#ifndef GLS_WIDE
#define GLS_WIDE 0 // 1: the light has no single direction, see light/rect.glsl
#endif
#ifndef GLS_PRECOMPUTED
#define GLS_PRECOMPUTED 0 // 1: <shadow> is receiver/precomputed.glsl
#endif
#ifndef GLS_PER_CHANNEL
#define GLS_PER_CHANNEL 0 // 1: what a surface receives differs by channel, see light/environment.glsl
#endif
#ifndef GLS_WEIGHED
#define GLS_WEIGHED 0 // 1, with GLS_ALONE: visibility and its weight by Lambert's law; 2: both for each channel of the light
#endif
#if GLS_EXACT
#include "lib/surface_point.glsl"
#endif
#if GLS_ROUNDED
#include "lib/smooth_point.glsl"
#endif
#if GLS_DIRECTIONS
#include "lib/directionmaps.glsl"
#endif
#if GLS_MATERIAL
#include "lib/material_packing.glsl"
#endif
#if GLS_GLOSSY || GLS_ROUGH
#include "lib/reflection.glsl"
#endif
#if GLS_EMITS
#include "lib/emission_packing.glsl"
uniform usampler2D u_emission;
#if GLS_METERED
uniform float u_white;
#endif
#endif

uniform usampler2D u_surface;
#if !GLS_POINTS
uniform sampler2D u_camera_depth;
#endif
#if !GLS_EXACT
uniform samplerBuffer u_planes; // per drawn triangle: unit world normal, distance from the scene's origin
#if GLS_ROUNDED || GLS_CAPSULES
uniform usamplerBuffer u_corners; // per drawn triangle: its vertices
uniform samplerBuffer u_positions; // of vertices, in world axes relative to the scene's origin
#endif
#endif
#if GLS_COLORS == 1
uniform usamplerBuffer u_owners; // per drawn triangle: its node
uniform samplerBuffer u_colors; // per node: base colour, linear
#endif
uniform sampler2D u_sum; // linear light of earlier passes
uniform vec3 u_background; // linear, seen through shadow catchers
flat in vec2 v_unproject; // this and what follows: see resolve.vert
flat in vec3 v_lv_from_l;
flat in vec3 v_forward_l;
flat in mat3 v_axes_l;
flat in vec3 v_towards_w;
flat in vec3 v_radiance; // these two include the base colour if all nodes share one
#if GLS_ROUGH
flat in vec3 v_light; // without the base colour
#endif
flat in vec3 v_ambient;
flat in vec3 v_ambient_below;
#if GLS_WEAK
uniform float u_strength;
#endif

#if GLS_ALONE
#if GLS_DIRECTIONS
layout(location = 0) out vec4 o_seen;
#if GLS_WEIGHED == 2
layout(location = 1) out vec4 o_unshadowed;
#endif
#elif GLS_WEIGHED == 2 && GLS_ALONE == 1
layout(location = 0) out vec4 o_seen;
layout(location = 1) out vec4 o_unshadowed;
#elif GLS_WEIGHED && GLS_ALONE == 1
layout(location = 0) out vec2 o_seen;
#else
layout(location = 0) out float o_seen;
#endif
#else
layout(location = 0) out vec4 o_color;
#endif
#if GLS_VISIBILITY && !GLS_ALONE
layout(location = 1) out float o_visibility;
#endif
#if GLS_SUM
layout(location = 2) out vec4 o_linear;
#endif

#if GLS_MARKS
bool light_ends_in(PixelFootprint f) { // whether the light shines on some of the footprint's corners but not on all
    vec3 rise = f.right + f.up, fall = f.right - f.up;
    bvec4 shone_on = bvec4(light_shines_on(f.middle - rise), light_shines_on(f.middle - fall), light_shines_on(f.middle + fall),
                           light_shines_on(f.middle + rise));
    return any(shone_on) && !all(shone_on);
}
#endif

vec3 towards_w(vec3 towards_l) {
#if GLS_AT_INFINITY
    return v_towards_w;
#else
    return towards_l * v_axes_l; // transposed: back to world axes
#endif
}

void main() {
#if GLS_PER_SAMPLE
    ivec2 pixel = sample_texel(ivec2(gl_FragCoord.xy));
    vec3 eye, ray;
    sample_ray(pixel, v_forward_l, eye, ray);
#else
    ivec2 pixel = ivec2(gl_FragCoord.xy);
#if !GLS_POINTS
    vec3 eye = v_eye_l, ray = v_ray_l;
#endif
#endif
    uvec4 surface = texelFetch(u_surface, pixel, 0);
    int triangle = triangle_of(surface.r);
#if GLS_POINTS
    GivenPoint given = given_point(pixel, v_axes_l);
    bool on_surface = triangle >= 0;
    triangle = max(triangle, 0);
#endif
#if GLS_PER_SAMPLE
    bool seen = triangle >= 0; // else background
    triangle = max(triangle, 0);
#endif
#if GLS_COLORS == 2
    vec3 color = unpack_color(surface.b);
#elif GLS_COLORS == 1
    vec4 colors = texelFetch(u_colors, int(texelFetch(u_owners, triangle).r)); // with GLS_ROUGH, w: 0 for what is matte
    vec3 color = colors.rgb;
#else
    const vec3 color = vec3(1.0); // included in v_ambient and v_radiance
#endif
#if GLS_FIRST || GLS_PER_SAMPLE
    vec3 sum = vec3(0.0);
#else
    vec3 sum = texelFetch(u_sum, pixel, 0).rgb;
#endif
#if GLS_EXACT
    Facet own = facet(triangle);
    vec3 normal = own.normal;
#if GLS_POINTS
    vec3 position = given.position + v_lv_from_l;
    position = on_surface ? onto_plane(triangle, own, position) : position;
    receiver_triangle = on_surface ? triangle : -1;
    receiver_corner = on_surface ? plane_corner(own) : position;
#if GLS_CAPSULES
    receiver_round = false;
#endif
#else
    vec3 position = surface_point(triangle, own, eye, ray, v_forward_l);
    receiver_triangle = triangle;
    receiver_corner = plane_corner(own);
#endif
    vec3 normal_w = normal * v_axes_l;
#if GLS_CAPSULES && !GLS_POINTS
    receiver_round = is_capsule(normal.x);
    if (receiver_round) {
        CapsuleHit hit = capsule_hit(capsule_of(own), eye, ray);
        normal = hit.normal;
        position = hit.position;
        normal_w = normal * v_axes_l;
        receiver_corner = position;
    }
#endif
#else
    vec4 plane = texelFetch(u_planes, triangle);
    vec3 normal_w = plane.xyz;
    vec3 normal = v_axes_l * normal_w;
#if GLS_POINTS
    vec3 position = given.position + v_lv_from_l;
#else
    float depth = v_unproject.x + v_unproject.y * texelFetch(u_camera_depth, pixel, 0).r;
#if !GLS_ORTHO
    depth = 1.0 / depth;
#endif
    vec3 position = eye + ray * depth;
    // Depth was interpolated between vertices snapped to 1/256 pixel: project back onto the plane, within the triangle's depth range, which
    // ray x plane would leave where the ray misses the triangle by a hair.
    position += normal * (plane.w - dot(normal, position)) + v_lv_from_l;
#if GLS_CAPSULES
    if (is_capsule(plane.x)) {
        uvec4 ends = texelFetch(u_corners, triangle);
        vec3 a = v_axes_l * texelFetch(u_positions, int(ends.x)).xyz, b = v_axes_l * texelFetch(u_positions, int(ends.y)).xyz;
        CapsuleHit hit = capsule_hit(Capsule(a, b, texelFetch(u_positions, int(ends.z)).x), eye, ray);
        normal = hit.normal;
        position = hit.position + v_lv_from_l;
        normal_w = normal * v_axes_l;
    }
#endif
#endif
#endif
#if GLS_POINTS
    float side = on_surface ? given_side(given, normal) : 1.0;
    receiver_free = !on_surface && given.normal == vec3(0.0);
    normal = on_surface ? normal : receiver_free ? light_arriving(position).xyz : normalize(given.normal);
#else
    float side = dot(normal, ray) > 0.0 ? -1.0 : 1.0; // the visible side
#endif
    normal *= side;
    vec3 lit_normal = normal;
#if GLS_PATTERN
    pattern_position = position;
#if GLS_ORTHO
    pattern_depth = 1.0;
#else
    pattern_depth = depth;
#endif
#endif
#if GLS_DIRECTIONS
    vec3 on_triangle = position;
#endif
#if GLS_ROUNDED
#if GLS_EXACT
    mat3 corners = mat3(own.a, own.b, own.c);
    float rounding = 2.0 * receiver_bound(position);
#else
    uvec4 vertices = texelFetch(u_corners, triangle);
    mat3 corners = mat3(v_lv_from_l, v_lv_from_l, v_lv_from_l)
        + v_axes_l * mat3(texelFetch(u_positions, int(vertices.x)).xyz, texelFetch(u_positions, int(vertices.y)).xyz,
                          texelFetch(u_positions, int(vertices.z)).xyz);
    float rounding = 1e-6 * dot(abs(position) + abs(v_lv_from_l), vec3(1.0));
#endif
#if GLS_DIRECTIONS
    const float turned_by = -1.0; // all the way: sum_directions scales it for each direction
#else
    float turned_by = dot(normal, light_arriving(position).xyz);
#endif
    SmoothPoint rounded = smooth_point(triangle, position, normal, side, turned_by, corners, v_axes_l, rounding);
#if GLS_POINTS
    if (!on_surface) rounded = SmoothPoint(position, normal, false, false);
#endif
    position = rounded.position;
    lit_normal = rounded.normal;
#if GLS_EXACT
    if (rounded.lifted) receiver_triangle = -1;
#endif
#endif
    vec4 arriving = light_arriving(position);
#if GLS_WIDE
    vec2 received = light_received(position, lit_normal);
    float cosine = received.x;
#else
    float cosine = dot(lit_normal, arriving.xyz);
#endif
#if GLS_POINTS
    cosine = receiver_free ? 1.0 : cosine;
#endif
#if GLS_PER_SAMPLE
    cosine = seen ? cosine : 0.0; // skips the shadow
#endif
#if GLS_CAPSULES && GLS_MARKS
    cosine = texelFetch(u_mixed, pixel, 0).r == MIXED ? 0.0 : cosine; // its samples are shaded one by one
#endif
    float facing = cosine; // > 0: the surface faces the light
#if GLS_ROUNDED && !GLS_WIDE
    // A map compares with the triangle's plane, or with that of the smooth surface where the triangle faces away below the point; the
    // latter not quite edge-on, or its depth would be undefined.
    vec3 tangent_normal = lit_normal + max(0.01 - cosine, 0.0) * arriving.xyz;
    vec3 plane_normal = rounded.lifted && dot(normal, arriving.xyz) <= 0.0 ? tangent_normal : normal;
    facing = min(cosine, dot(plane_normal, arriving.xyz));
#else
    vec3 plane_normal = normal;
#endif
    float lit = surface_visibility(surface.r, position, plane_normal, facing);
#if GLS_ALONE != 1
    lit = light_shines_on(position) ? lit : 0.0;
#endif
#if GLS_ALONE
#if GLS_DIRECTIONS
#if GLS_SELECTIVE
    bool darkened = is_darkened(surface.r);
#else
    const bool darkened = true;
#endif
#if !GLS_PER_SAMPLE
    const bool seen = true;
#endif
    DirectionSums sums = sum_directions(pixel, on_triangle, normal, lit_normal, position - on_triangle, darkened, seen);
    vec2 plane_of = vec2(0.0, pack_plane_normal(normal));
    plane_of.x = dot(unpack_plane_normal(plane_of.y), on_triangle);
#if GLS_WEIGHED == 2
    o_seen = vec4(sums.seen, plane_of.x);
    o_unshadowed = vec4(sums.all, plane_of.y);
#else
    o_seen = vec4(sums.seen, sums.all, plane_of);
#endif
#elif GLS_WEIGHED == 2 && GLS_ALONE == 1
    o_unshadowed = vec4(v_radiance * max(cosine, 0.0), 0.0);
    o_seen = o_unshadowed * lit;
#elif GLS_WEIGHED && GLS_ALONE == 1
    o_seen = vec2(lit, 1.0) * max(cosine, 0.0);
#else
    o_seen = lit;
#endif
#else
#if GLS_PER_CHANNEL
    vec3 shading_normal = lit_normal;
#endif
    float lambert = cosine;
    float height = normal_w.y * side;
#if GLS_ROUNDED
    height = rounded.smooth_ ? dot(lit_normal, v_axes_l[1]) : height;
#if GLS_BUMPED
    const bool bent = false; // a normal map may have changed it
#else
    bool bent = rounded.smooth_; // its normal is the shading normal already
#endif
#else
    const bool bent = false;
#endif
#if GLS_GLOSSY || GLS_ROUGH
    vec3 shown = lit_normal;
#endif
#if GLS_SURFACE > 1
    if (surface.g != 0u && !bent) { // an interpolated normal, flipped to the same side
        vec3 shading = unpack_direction(surface.g);
#if GLS_BUMPED
        float turned = dot(shading, lit_normal * v_axes_l) < 0.0 ? -1.0 : 1.0;
#else
        float turned = dot(shading, normal_w) * side < 0.0 ? -1.0 : 1.0;
#endif
#if GLS_GLOSSY || GLS_ROUGH
        shown = normalize(v_axes_l * shading) * turned;
#endif
#if GLS_PER_CHANNEL
        shading_normal = normalize(v_axes_l * shading) * turned;
#elif GLS_WIDE
        lambert = light_received(position, normalize(v_axes_l * shading) * turned).x;
#else
        lambert = dot(shading, towards_w(arriving.xyz)) * inversesqrt(dot(shading, shading));
        lambert *= turned;
#endif
        height = shading.y * inversesqrt(dot(shading, shading)) * turned;
    }
#endif
#if GLS_WEAK
    float share = facing > 0.0 ? 1.0 - u_strength * (1.0 - lit) : 0.0;
#else
    float share = lit;
#endif
#if GLS_WIDE
    share = received.y > 0.0 ? min(share / received.y, 1.0) : 0.0; // both without what is below the horizon
#endif
#if !GLS_FIRST
    const vec3 ambient = vec3(0.0);
#elif GLS_HEMISPHERE
    vec3 ambient = mix(v_ambient_below, v_ambient, 0.5 + 0.5 * height);
#else
    vec3 ambient = v_ambient;
#endif
#if GLS_MATERIAL
    vec4 material = unpack_material(surface.a);
#endif
#if GLS_OCCLUDED && GLS_FIRST
    ambient *= material.w;
#endif
#if GLS_ROUGH
    vec3 passed = cookie_at(position) * transmitted(position, normal), radiance = v_radiance * passed;
#else
    vec3 radiance = v_radiance * cookie_at(position) * transmitted(position, normal);
#endif
#if GLS_PER_CHANNEL
    vec3 irradiance = light_irradiance(position, shading_normal) * (facing > 0.0 ? 1.0 : 0.0);
#if GLS_PRECOMPUTED
    vec3 open_to = channel_visibility();
#else
    vec3 open_to = vec3(lit);
#endif
#if GLS_WEAK
    open_to = 1.0 - u_strength * (1.0 - open_to);
#endif
    vec3 light = ambient + radiance * irradiance * open_to;
#else
    vec3 light = ambient + radiance * (max(lambert, 0.0) * arriving.w * share);
#endif
#if GLS_CATCHES
    vec3 untinted = v_radiance * cookie_at(position); // what translucent casters take away is shadow too
#endif
#if GLS_CATCHES && GLS_PER_CHANNEL
    vec3 unshadowed = ambient + untinted * irradiance;
#elif GLS_CATCHES
    vec3 unshadowed = ambient + untinted * (facing > 0.0 ? max(lambert, 0.0) * arriving.w : 0.0);
#endif
#if GLS_VISIBILITY
#if GLS_PER_SAMPLE
    o_visibility = seen ? lit : uintBitsToFloat(0x7fc00000u);
#else
    o_visibility = lit;
#if GLS_MARKS
#if GLS_SELECTIVE
    bool darkened = is_darkened(surface.r);
#else
    const bool darkened = true;
#endif
    PixelFootprint sampled = pixel_footprint(position, normal, eye, ray);
    bool differ = darkened && samples_differ(sampled, cosine, lit) || !sampled.mixed && light_ends_in(sampled);
    o_visibility += differ ? 2.0 : 0.0; // read by pass/collect.frag
#endif
#endif
#endif
#if GLS_CATCHES
    bool catcher = is_catcher(surface.r);
#else
    const bool catcher = false;
#endif
    vec3 sent = color * light;
#if (GLS_GLOSSY || GLS_ROUGH) && !(GLS_WIDE && GLS_AT_INFINITY) && !GLS_PER_CHANNEL // a sky is reflected as ambient light is
#if GLS_ORTHO
    vec3 to_eye = -v_forward_l;
#else
    vec3 to_eye = normalize(-ray);
#endif
#if GLS_WIDE // as if all of it came from its middle, or from just above the horizon
    vec3 middle = normalize(arriving.xyz + max(0.02 - dot(shown, arriving.xyz), 0.0) * shown);
#else
    vec3 middle = arriving.xyz;
#endif
#if GLS_GLOSSY
    for (int turn = material.y > 1.0 ? 0 : 1; turn > 0; turn--) { // not what is matte; a loop, since llvmpipe skips no `if`
        vec3 lobes = reflected(color, material.z, material.y, shown, to_eye, middle);
#if GLS_WIDE
        lobes *= max(lambert, 0.0) / dot(shown, middle);
#endif
        sent = color * ambient + radiance * lobes * (arriving.w * share);
    }
#else
#if GLS_COLORS == 2
    bool rough = material.y <= 1.0;
#elif GLS_COLORS == 1
    bool rough = colors.w > 0.0;
#else
    const bool rough = true;
#endif
    vec2 lobes = reflected_roughly(shown, to_eye, middle);
    vec3 both = (color * v_radiance * lobes.x + v_light * lobes.y) * passed;
    sent = rough ? color * ambient + both * (max(lambert, 0.0) * arriving.w * share) : sent;
#endif
#endif
#if (GLS_GLOSSY || GLS_ROUGH) && GLS_PER_CHANNEL
#if GLS_ORTHO
    vec3 to_eye = -v_forward_l;
#else
    vec3 to_eye = normalize(-ray);
#endif
#if GLS_GLOSSY
    bool reflects = material.y <= 1.0;
    float roughness = max(min(material.y, 1.0), LEAST_ROUGHNESS), metallic = material.z;
    vec3 bare = radiance;
#else
#if GLS_COLORS == 2
    bool reflects = material.y <= 1.0;
#elif GLS_COLORS == 1
    bool reflects = colors.w > 0.0;
#else
    const bool reflects = true;
#endif
    const float roughness = 1.0, metallic = 0.0;
    vec3 bare = v_light * passed;
#endif
    float cos_eye = max(dot(shown, to_eye), 0.0);
    vec3 clear = light_reflectance(vec3(DIELECTRIC), roughness, cos_eye); // of the part that is not metal
    vec3 both = color * radiance * irradiance * open_to * ((1.0 - metallic) * (1.0 - clear));
    both += bare * mix(clear, light_reflectance(color, roughness, cos_eye), metallic) * light_reflection(reflect(-to_eye, shown), roughness) * share;
    sent = reflects ? color * ambient + both : sent;
#endif
#if GLS_CATCHES
    sum += catcher ? vec3(dot(light, LUMINANCE), dot(unshadowed, LUMINANCE), 0.0) : sent;
#else
    sum += sent;
#endif
#if GLS_EMITS && GLS_FIRST
    vec3 emitted = unpack_emission(texelFetch(u_emission, pixel, 0).r);
#if GLS_METERED
    emitted *= u_white;
#endif
    sum += catcher ? vec3(0.0) : emitted;
#endif
#if GLS_PER_SAMPLE
    // read back by pass/average.frag
    o_color = seen ? vec4(sum, GLS_FIRST == 0 ? 0.0 : catcher ? 2.0 : 1.0) : vec4(0.0);
#elif GLS_LAST
    vec4 done = finished(sum, catcher);
    vec3 display = toned(exposed(done.rgb));
#if GLS_CATCHES
    vec3 behind = u_background * (1.0 - done.a); // a display's colour: neither exposed nor tone mapped
    display += behind;
    done.rgb += behind;
#endif
    o_color = vec4(srgb(clamp(display, 0.0, 1.0)), done.a);
#if GLS_SUM
    o_linear = done;
#endif
#else
    o_color = vec4(sum, 1.0);
#endif
#endif
}
