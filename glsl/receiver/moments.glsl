// Slot <shadow> for a light with a prefiltered moment map: as receiver/mapped.glsl, with linear depth and no comparison.
#ifndef GLS_CASCADES
#define GLS_CASCADES 0 // number of cascades of a directional light
#endif
#include "receiver/receiver.glsl"
#include <projection>
#include "lib/even_depth.glsl"
#include <bias>
#include "lib/footprint.glsl"
#include "lib/moment_map.glsl"
#include <filter>
#if GLS_CASCADES
#include "receiver/chosen.glsl"
#else
#include "receiver/map_visibility.glsl"
#endif
