// Resets the depth of opaque surfaces in pixels that no blended layer covers: their light is known from the opaque image. Draw at the far
// plane, with a depth attachment only.
#include "lib/layered.glsl"

void main() {
    if (is_layered(pixel_of(ivec2(gl_FragCoord.xy)))) discard;
}
