// The camera's rays over the image, in the light's axes, passed from pass/resolve.vert to fragment shaders. Values shared by all pixels are
// flat, the others linear over the image.
#ifndef GLS_ORTHO
#define GLS_ORTHO 0 // 0: perspective camera, 1: orthographic camera, parallel rays
#endif
#ifndef GLS_PER_SAMPLE
#define GLS_PER_SAMPLE 0 // 1: draws samples of collected pixels, not the image; each computes its own ray, see lib/per_sample.glsl
#endif
#ifndef GLS_STAGE
#define GLS_STAGE 0 // > 0: draws collected pixels, which also compute their rays, see pass/penumbra.frag
#endif
#if GLS_PER_SAMPLE || GLS_STAGE > 0
flat GLS_VARYING mat3 v_ray_from_ndc;
flat GLS_VARYING vec3 v_eye_l;
#elif GLS_ORTHO
flat GLS_VARYING vec3 v_ray_l; // of unit view depth
noperspective GLS_VARYING vec3 v_eye_l; // start of the ray
#else
noperspective GLS_VARYING vec3 v_ray_l;
flat GLS_VARYING vec3 v_eye_l;
#endif
