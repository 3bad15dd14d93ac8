// One triangle over the whole image, at the far plane: the depth test then skips the background. Constants of the pass are passed as flat
// varyings: llvmpipe (Mesa 22.3) loads those once per block of pixels, but uniforms repeatedly (2 of 12 ms).
#ifndef GLS_ORTHO
#define GLS_ORTHO 0 // 1: an orthographic camera
#endif
#ifndef GLS_PER_SAMPLE
#define GLS_PER_SAMPLE 0 // 1: samples of collected pixels
#endif
#ifndef GLS_STAGE
#define GLS_STAGE 0 // > 0: collected pixels, see pass/penumbra.frag
#endif
#ifndef GLS_ROUGH
#define GLS_ROUGH 0
#endif
#include "lib/camera_rays.glsl"
uniform float u_far_z; // NDC z of the far plane
uniform mat3 u_ray_l; // u_ray_l * (NDC x, y, 1), in the light's axes: ray of unit view depth; GLS_ORTHO: its start, from the eye
uniform vec2 u_unproject; // x + y * window depth = 1 / view depth; GLS_ORTHO: view depth
uniform vec3 u_eye_l; // the eye in the light's axes, relative to the scene's origin (exact filters: to the light's origin)
uniform vec3 u_lv_from_l; // from the scene's origin to the light's origin
uniform vec3 u_forward_l; // the camera's viewing direction
uniform mat3 u_axes_l; // the light's axes
uniform vec3 u_towards_w; // to a directional light
uniform vec3 u_radiance; // color * intensity
#if GLS_ROUGH
uniform vec3 u_light; // color * intensity, without the base colour
flat out vec3 v_light;
#endif
uniform vec3 u_ambient;
uniform vec3 u_ambient_below;
flat out vec2 v_unproject;
flat out vec3 v_lv_from_l;
flat out vec3 v_forward_l;
flat out mat3 v_axes_l;
flat out vec3 v_towards_w;
flat out vec3 v_radiance;
flat out vec3 v_ambient;
flat out vec3 v_ambient_below;
const vec2 corner[3] = vec2[3](vec2(-1.0, -1.0), vec2(3.0, -1.0), vec2(-1.0, 3.0));

void main() {
#if GLS_PER_SAMPLE || GLS_STAGE > 0
    v_ray_from_ndc = u_ray_l;
    v_eye_l = u_eye_l;
#elif GLS_ORTHO
    v_ray_l = u_forward_l;
    v_eye_l = u_eye_l + u_ray_l * vec3(corner[gl_VertexID], 1.0);
#else
    v_ray_l = u_ray_l * vec3(corner[gl_VertexID], 1.0);
    v_eye_l = u_eye_l;
#endif
    v_unproject = u_unproject;
    v_lv_from_l = u_lv_from_l;
    v_forward_l = u_forward_l;
    v_axes_l = u_axes_l;
    v_towards_w = u_towards_w;
    v_radiance = u_radiance;
#if GLS_ROUGH
    v_light = u_light;
#endif
    v_ambient = u_ambient;
    v_ambient_below = u_ambient_below;
    gl_Position = vec4(corner[gl_VertexID], u_far_z, 1.0);
}
