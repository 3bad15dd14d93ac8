// A depth texture read texel by texel: for filters that need depths, on drivers without gather.
#include "lib/stored_depth.glsl"
#include "lib/four_taps.glsl"
