// Slot <shadow> for a light with a shadow map: bias, project, compare, filter. The same for every light, target and filter.
#ifndef GLS_CASCADES
#define GLS_CASCADES 0 // number of cascades of a directional light
#endif
#include "receiver/receiver.glsl"
#include <projection>
#include <depth>
#include <bias>
#include <compare>
#include <filter>
#if GLS_CASCADES
#include "receiver/chosen.glsl"
#else
#include "receiver/map_visibility.glsl"
#endif
#ifndef GLS_MARKS
#define GLS_MARKS 0 // 1: also computes whether the samples of a pixel may see the light differently
#endif
#if GLS_MARKS
#include "receiver/marks.glsl"
#endif
