// A surface point in one light's shadow map. Filled by <projection>, made comparable by <depth>, read by <filter>.
#ifndef GLS_CORE
#define GLS_CORE 0
#endif
#ifndef GLS_PER_SAMPLE
#define GLS_PER_SAMPLE 0
#endif
#ifndef GLS_MIP_LEVELS
#define GLS_MIP_LEVELS 0 // levels above the finest
#endif
#if !GLS_CORE || GLS_PER_SAMPLE // collected samples have no neighbours for derivatives, and are many
#undef GLS_MIP_LEVELS
#define GLS_MIP_LEVELS 0
#endif
struct Receiver {
    vec2 texel;   // position in the atlas, texels; texel [i, j] has its centre at (i + 0.5, j + 0.5)
    vec2 tangent; // direction from the light, per unit of its depth (0 for a directional light)
    float depth;  // <projection>: the base, u_base.x * depth (directional) or u_base.x / depth; after start_depth: comparable
    vec2 slope;   // gradient of depth per texel, along the receiver's own plane
#if GLS_MIP_LEVELS
    float level;  // mip level: texels of a pixel's size
#endif
};
