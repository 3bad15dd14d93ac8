// Composites the layers of each sample over the opaque surface or the background, and averages the samples of a pixel, in linear light.
// Not a number where no layer covers the pixel.
#include "lib/layered.glsl"
uniform sampler2D u_light; // linear light of the opaque surfaces over the background, premultiplied, with alpha
layout(location = 0) out vec4 o_mean;
const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722); // ITU-R BT.709

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 total = vec4(0.0);
    for (int i = 0; i < SAMPLES; i++) {
        ivec2 place = sample_of(pixel, i);
        vec4 behind = texelFetch(u_light, place, 0);
        vec3 through = texelFetch(u_through, place, 0).rgb;
        total.rgb += texelFetch(u_added, place, 0).rgb + through * behind.rgb;
        total.a += 1.0 - dot(through, LUMINANCE) * (1.0 - behind.a);
    }
    o_mean = is_layered(pixel) ? total / float(SAMPLES) : vec4(uintBitsToFloat(0x7fc00000u));
}
