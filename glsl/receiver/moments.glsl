// Slot <shadow> for a light whose map holds means of depth: as receiver/mapped.glsl, with one kind of depth and nothing to compare.
#ifndef GLS_CASCADES
#define GLS_CASCADES 0 // maps of a sun, if it has several
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
