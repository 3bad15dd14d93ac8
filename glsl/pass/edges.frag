// Collects the pixels that a shadow's edge goes through: those one of whose four neighbours is not as visible. Each leaves its number
// and its visibility in place of its visibility: -1 - (2 number + visibility), so that a neighbour that comes later still knows it.
layout(early_fragment_tests) in;
layout(std430, binding = 0) buffer Edges { uint edge_count; };
layout(std430, binding = 1) writeonly buffer Pixels { uint pixels[]; }; // x, y << 16
layout(r32f, binding = 0) writeonly uniform image2D u_marks;
uniform sampler2D u_given; // visibility: 0 or 1, NaN where there is no surface

float seen(ivec2 pixel) {
    float given = texelFetch(u_given, pixel, 0).r;
    return given < 0.0 ? mod(-1.0 - given, 2.0) : given;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(u_given, 0) - 1;
    float own = seen(pixel);
    vec4 others = vec4(
        seen(ivec2(max(pixel.x - 1, 0), pixel.y)), seen(ivec2(min(pixel.x + 1, last.x), pixel.y)),
        seen(ivec2(pixel.x, max(pixel.y - 1, 0))), seen(ivec2(pixel.x, min(pixel.y + 1, last.y)))
    );
    bvec4 differs = greaterThan(abs(others - own), vec4(0.5)); // a NaN does not
    int mixed = any(differs) ? 1 : 0;
    for (int i = 0; i < mixed; i++) { // not an if: llvmpipe would go through the atomics of every pixel
        uint place = atomicAdd(edge_count, 1u);
        pixels[place] = uint(pixel.x) | uint(pixel.y) << 16u;
        imageStore(u_marks, pixel, vec4(-1.0 - (2.0 * float(place) + own)));
    }
}
