// The camera's ray through a sample, in the light's axes. Needs lib/camera_rays.glsl in a mode where fragments compute their rays.
#ifndef GLS_ORTHO
#define GLS_ORTHO 0 // 1: an orthographic camera
#endif
uniform vec2 u_samples; // columns and rows of all samples of the image

void sample_ray(ivec2 texel, vec3 forward, out vec3 eye, out vec3 ray) { // forward: the camera's viewing direction
    vec3 through = v_ray_from_ndc * vec3((vec2(texel) + 0.5) * 2.0 / u_samples - 1.0, 1.0);
#if GLS_ORTHO
    eye = v_eye_l + through;
    ray = forward;
#else
    eye = v_eye_l;
    ray = through;
#endif
}
