// Collects the pixels whose samples differ: those that pass/fill.frag found mixed, and those that a shadow's edge goes through, one of
// whose four neighbours is not as visible to the light as they are. Drawn once for each light, over what is seen; no pixel is collected
// twice.
#ifndef GLS_LIGHTS
#define GLS_LIGHTS 1 // 2: the first of several, 3: another one
#endif
layout(early_fragment_tests) in;
layout(std430, binding = 0) buffer Collected { uint collected_count; };
layout(std430, binding = 1) writeonly buffer Pixels { uint pixels[]; }; // x, y << 16
#if GLS_LIGHTS == 1
uniform usampler2D u_mixed;
#else
layout(r8ui, binding = 0) uniform uimage2D u_taken; // 1: mixed, or collected
#endif
uniform sampler2D u_visibility; // NaN where there is no surface
const float DIFFERS = 0.3; // of a soft edge that is wider than three pixels its middle is its mean

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 texel = 1.0 / vec2(textureSize(u_visibility, 0));
    // four pixels at a time, about a corner of this one; at the border of the image the pixel itself is repeated
    vec4 below = textureGather(u_visibility, vec2(pixel) * texel), above = textureGather(u_visibility, vec2(pixel + 1) * texel);
    float own = below.y;
    vec4 others = vec4(below.x, below.z, above.x, above.z); // left, down, up, right
    bool differs = any(greaterThan(abs(others - own), vec4(DIFFERS))); // a NaN does not
#if GLS_LIGHTS == 1
    bool taken = texelFetch(u_mixed, pixel, 0).r != 0u;
#else
    bool taken = imageLoad(u_taken, pixel).r != 0u;
#endif
    int wanted = (GLS_LIGHTS == 3 ? differs && !taken : differs || taken) ? 1 : 0;
    for (int i = 0; i < wanted; i++) { // not an if: llvmpipe would go through the atomics of every pixel
        pixels[atomicAdd(collected_count, 1u)] = uint(pixel.x) | uint(pixel.y) << 16u;
#if GLS_LIGHTS > 1
        imageStore(u_taken, pixel, uvec4(1u));
#endif
    }
}
