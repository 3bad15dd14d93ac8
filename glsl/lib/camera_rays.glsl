// The camera's rays over the image, in the light's axes, from pass/resolve.vert to what is drawn with it. What all pixels share is flat,
// the other linear over the image.
#ifndef GLS_ORTHO
#define GLS_ORTHO 0 // 0: rays leave one eye, 1: they run side by side (orthographic camera)
#endif
#ifndef GLS_PER_SAMPLE
#define GLS_PER_SAMPLE 0 // 1: what is drawn are samples of collected pixels, not the image: each finds its own ray, see lib/per_sample.glsl
#endif
#ifndef GLS_STAGE
#define GLS_STAGE 0 // more: so do collected pixels, see pass/penumbra.frag
#endif
#if GLS_PER_SAMPLE || GLS_STAGE > 0
flat GLS_VARYING mat3 v_ray_from_ndc;
flat GLS_VARYING vec3 v_eye_l;
#elif GLS_ORTHO
flat GLS_VARYING vec3 v_ray_l; // of unit view depth
noperspective GLS_VARYING vec3 v_eye_l; // where it starts
#else
noperspective GLS_VARYING vec3 v_ray_l;
flat GLS_VARYING vec3 v_eye_l;
#endif
