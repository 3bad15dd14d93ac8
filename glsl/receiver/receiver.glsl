// A surface point as one light's shadow map sees it. Filled by <projection>, made comparable by <depth>, read by <filter>.
struct Receiver {
    vec2 texel;   // position in the atlas, texels; texel [i, j] has its centre at (i + 0.5, j + 0.5)
    vec2 tangent; // direction from the light, per unit of its depth (0 for a sun)
    float depth;  // <projection>: the base, u_base.x * distance along a sun's view or u_base.x / depth; behind start_depth: comparable
    vec2 slope;   // gradient of depth per texel, following the receiver's own plane
};
