// Slot <shadow> for a light with a map: bias, project, compare, filter. One contract for every light, target and technique.
#include "receiver/receiver.glsl"
#include <projection>
#include <depth>
#include <bias>
#include <compare>
#include <filter>
#include "receiver/answered.glsl"
