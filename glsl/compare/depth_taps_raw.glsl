// A depth texture read texel by texel: for filters that must know the depths, where nothing gathers.
#include "lib/stored_depth.glsl"
#include "lib/four_taps.glsl"
