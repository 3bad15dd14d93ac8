// The light's visibility of a surface point: 0 where it faces away, 1 where it receives no shadows. Needs <shadow> and
// lib/surface_number.glsl.
#ifndef GLS_SELECTIVE
#define GLS_SELECTIVE 0 // 1: some triangles receive no shadows
#endif
#ifndef GLS_PRECOMPUTED
#define GLS_PRECOMPUTED 0 // 1: <shadow> is final: it takes account of an area light that is partly above the receiver's horizon
#endif
#ifndef GLS_WIDE
#define GLS_WIDE 0
#endif
float surface_visibility(uint number, vec3 position, vec3 normal, float cosine) {
#if GLS_PRECOMPUTED
    float seen = light_visibility(position, normal, cosine);
    return GLS_WIDE == 1 && cosine <= 0.0 ? 0.0 : seen;
#else
    float lit = cosine > 0.0 ? light_visibility(position, normal, cosine) : 0.0;
#if GLS_SELECTIVE
    lit = is_darkened(number) || cosine <= 0.0 ? lit : 1.0;
#endif
    return lit;
#endif
}
