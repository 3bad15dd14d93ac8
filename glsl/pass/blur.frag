// The mean of 2 R + 1 texels in a row.
#ifndef GLS_MOMENT_RADIUS
#define GLS_MOMENT_RADIUS 1
#endif
uniform sampler2D u_moments;
uniform vec2 u_along; // (1, 0) or (0, 1)
layout(location = 0) out vec4 o_moments;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy), along = ivec2(u_along), most = textureSize(u_moments, 0) - 1;
    vec4 sum = vec4(0.0);
    for (int i = -GLS_MOMENT_RADIUS; i <= GLS_MOMENT_RADIUS; i++) {
        sum += texelFetch(u_moments, clamp(texel + i * along, ivec2(0), most), 0);
    }
    o_moments = sum / float(2 * GLS_MOMENT_RADIUS + 1);
}
