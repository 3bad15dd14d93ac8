// The light's visibility of a surface point: none where it faces away, all where no shadow falls on it. Needs <shadow> and
// lib/surface_number.glsl.
#ifndef GLS_SELECTIVE
#define GLS_SELECTIVE 0 // 1: some triangles are not darkened
#endif
#ifndef GLS_PRECOMPUTED
#define GLS_PRECOMPUTED 0 // 1: what <shadow> says is all: it knows the light's size, which may look over the receiver's horizon
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
