// Finds the pixels near a shadow's edge: those whose 3 x 3 neighbours are not all as visible. They get depth 1 and begin at 0; the
// others depth 0 and keep what they have.
uniform sampler2D u_probe; // 0 or 1; where there is no surface 0.5
layout(location = 0) out vec4 o_visibility;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(u_probe, 0) - 1;
    float own = texelFetch(u_probe, pixel, 0).r;
    bool mixed = false;
    for (int y = -1; y <= 1; y++) {
        for (int x = -1; x <= 1; x++) {
            float other = texelFetch(u_probe, clamp(pixel + ivec2(x, y), ivec2(0), last), 0).r;
            mixed = mixed || abs(other - own) > 0.75;
        }
    }
    o_visibility = vec4(mixed ? 0.0 : own);
    gl_FragDepth = mixed ? 1.0 : 0.0;
}
