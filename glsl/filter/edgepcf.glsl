// Percentage closer filtering at edges only: five of the blocks of filter/pcf.glsl decide whether the others are read too.
// Isidoro 2006, "Shadow Mapping: GPU-based Tips and Techniques". Twin: glshadow.shadows.filters.edge_pcf
#ifndef GLS_PCF_RADIUS
#define GLS_PCF_RADIUS 1
#endif
#include "lib/box.glsl"

float visibility(Receiver receiver) {
    Blocks blocks = blocks_around(receiver, GLS_PCF_RADIUS);
    vec4 few = block(receiver, blocks, 0, 0) + block(receiver, blocks, GLS_PCF_RADIUS, 0);
    few += block(receiver, blocks, 0, GLS_PCF_RADIUS) + block(receiver, blocks, GLS_PCF_RADIUS, GLS_PCF_RADIUS);
    few += block(receiver, blocks, GLS_PCF_RADIUS / 2, GLS_PCF_RADIUS / 2);
    float lit = dot(few, vec4(1.0)); // of 20 comparisons
    bool edge = lit > 0.5 && lit < 19.5;
    float sum = 0.0;
#if GLS_CORE
    // a loop without turns is skipped if no pixel of a block is at an edge; llvmpipe skips neither branches nor unrolled loops
    int last = edge ? GLS_PCF_RADIUS : -1;
    for (int j = 0; j <= last; j++) {
#else
    for (int j = 0; j <= GLS_PCF_RADIUS; j++) {
        if (!edge) break;
#endif
        for (int i = 0; i <= GLS_PCF_RADIUS; i++) sum += box_block(receiver, blocks, i, j);
    }
    return edge ? box_mean(sum) : step(0.5, lit);
}
