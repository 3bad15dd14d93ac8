// Least and greatest window depth of a tile of pixels, without the background; 1 and 0 for a tile of background only.
#ifndef GLS_SIDE
#define GLS_SIDE 16
#endif
uniform sampler2D u_depth;
uniform float u_nothing; // clear depth
layout(location = 0) out vec2 o_ends;

void main() {
    ivec2 first = GLS_SIDE * ivec2(gl_FragCoord.xy), most = textureSize(u_depth, 0) - 1;
    vec2 ends = vec2(1.0, 0.0);
    for (int y = 0; y < GLS_SIDE; y++) {
        for (int x = 0; x < GLS_SIDE; x++) {
            float depth = texelFetch(u_depth, min(first + ivec2(x, y), most), 0).r;
            bool seen = depth != u_nothing;
            ends = seen ? vec2(min(ends.x, depth), max(ends.y, depth)) : ends;
        }
    }
    o_ends = ends;
}
