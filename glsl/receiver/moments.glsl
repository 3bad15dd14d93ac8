// Slot <shadow> for a light whose map holds means of depth: as receiver/mapped.glsl, with one kind of depth and nothing to compare.
#include "receiver/receiver.glsl"
#include <projection>
#include "lib/even_depth.glsl"
#include <bias>
#include "lib/means.glsl"
#include <filter>
#include "receiver/answered.glsl"
