// What translucent casters let through of a light to the visible surfaces; positions as in pass/resolve.frag, from depth and plane.
#ifndef GLS_ORTHO
#define GLS_ORTHO 0
#endif
#include "lib/camera_rays.glsl"
#include "lib/surface_number.glsl"
#include "lib/tint.glsl"
uniform usampler2D u_surface;
uniform sampler2D u_camera_depth;
uniform samplerBuffer u_planes; // per drawn triangle: unit world normal, distance from the scene's origin
flat in vec2 v_unproject;
flat in vec3 v_lv_from_l;
flat in mat3 v_axes_l;
layout(location = 0) out vec4 o_through;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 plane = texelFetch(u_planes, triangle_of(texelFetch(u_surface, pixel, 0).r));
    vec3 normal = v_axes_l * plane.xyz;
    float depth = v_unproject.x + v_unproject.y * texelFetch(u_camera_depth, pixel, 0).r;
#if !GLS_ORTHO
    depth = 1.0 / depth;
#endif
    vec3 position = v_eye_l + v_ray_l * depth;
    position += normal * (plane.w - dot(normal, position)) + v_lv_from_l;
    normal *= dot(normal, v_ray_l) > 0.0 ? -1.0 : 1.0; // the visible side
    o_through = vec4(transmitted(position, normal), 1.0);
}
