// Collects the pixels whose samples differ: those that pass/fill.frag found mixed, and those that a shadow's edge goes through, one of
// whose four neighbours is not as visible to the light as they are. Drawn once for each light, over what is seen; no pixel is collected
// twice.
#ifndef GLS_LIGHTS
#define GLS_LIGHTS 1 // 2: the first of several, 3: another one
#endif
layout(early_fragment_tests) in;
layout(std430, binding = 0) buffer Collected { uint collected_count; };
layout(std430, binding = 1) writeonly buffer Pixels { uint pixels[]; }; // x, y << 16
layout(r8ui, binding = 0) uniform uimage2D u_taken; // 1: mixed, or collected
uniform sampler2D u_visibility; // NaN where there is no surface
const float DIFFERS = 0.3; // of a soft edge that is wider than three pixels its middle is its mean

float seen(ivec2 pixel) {
    return texelFetch(u_visibility, pixel, 0).r;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(u_visibility, 0) - 1;
    float own = seen(pixel);
    vec4 others = vec4(
        seen(ivec2(max(pixel.x - 1, 0), pixel.y)), seen(ivec2(min(pixel.x + 1, last.x), pixel.y)),
        seen(ivec2(pixel.x, max(pixel.y - 1, 0))), seen(ivec2(pixel.x, min(pixel.y + 1, last.y)))
    );
    bool differs = any(greaterThan(abs(others - own), vec4(DIFFERS))); // a NaN does not
    bool taken = imageLoad(u_taken, pixel).r != 0u;
    int wanted = (GLS_LIGHTS == 3 ? differs && !taken : differs || taken) ? 1 : 0;
    for (int i = 0; i < wanted; i++) { // not an if: llvmpipe would go through the atomics of every pixel
        pixels[atomicAdd(collected_count, 1u)] = uint(pixel.x) | uint(pixel.y) << 16u;
#if GLS_LIGHTS > 1
        imageStore(u_taken, pixel, uvec4(1u));
#endif
    }
}
