// Draws small triangles into the depth maps of some directions of light, one invocation for each triangle: at each texel whose centre it
// covers, the least depth. A rasteriser would set up every triangle for every map, though few of them cover a texel's centre.
// Twin of the caster pass with a depth target: window depth, 0 nearest to the light, as the bits of a float, which are in its order.
layout(local_size_x = 64) in;
layout(r32ui, binding = 0) coherent uniform uimage2D u_bits;
uniform samplerBuffer u_positions; // of vertices, in world axes relative to the scene's origin
uniform usamplerBuffer u_corners; // per drawn triangle: its vertices
uniform usamplerBuffer u_chosen; // triangles; bits 31, 30: one that winds clockwise, or counterclockwise, as the light sees it, is left out
uniform ivec2 u_part; // the first of them, and the end
// of each direction: to texels of the atlas, right and up, to window depth; first and last texel of its tile
uniform vec4 u_rows[4 * 8];

const float INCLUSIVE = -1e-5; // of barycentric coordinates: no texel is lost between two triangles

void draw_direction(int k, vec3 a, vec3 b, vec3 c, uint sides) {
    vec4 right = u_rows[4 * k], up = u_rows[4 * k + 1], away = u_rows[4 * k + 2], tile = u_rows[4 * k + 3];
    vec3 p = vec3(dot(right.xyz, a) + right.w, dot(up.xyz, a) + up.w, dot(away.xyz, a) + away.w);
    vec3 q = vec3(dot(right.xyz, b) + right.w, dot(up.xyz, b) + up.w, dot(away.xyz, b) + away.w);
    vec3 r = vec3(dot(right.xyz, c) + right.w, dot(up.xyz, c) + up.w, dot(away.xyz, c) + away.w);
    vec2 low = max(ceil(min(p.xy, min(q.xy, r.xy)) - 0.5), tile.xy), high = min(floor(max(p.xy, max(q.xy, r.xy)) - 0.5), tile.zw);
    vec3 e = q - p, f = r - p;
    float area = e.x * f.y - e.y * f.x;
    bool drawn = area != 0.0 && (sides & (area < 0.0 ? 0x80000000u : 0x40000000u)) == 0u;
    float scale = 1.0 / (area == 0.0 ? 1.0 : area);
    ivec2 span = max(ivec2(high - low) + 1, ivec2(0));
    vec2 at = low;
    for (int left = drawn ? span.x * span.y : 0; left > 0; left--) {
        vec2 g = at + 0.5 - p.xy;
        float u = (g.x * f.y - g.y * f.x) * scale, v = (e.x * g.y - e.y * g.x) * scale;
        if (min(min(u, v), 1.0 - u - v) >= INCLUSIVE)
            imageAtomicMin(u_bits, ivec2(at), floatBitsToUint(clamp(p.z + u * e.z + v * f.z, 0.0, 1.0)));
        at = at.x < high.x ? vec2(at.x + 1.0, at.y) : vec2(low.x, at.y + 1.0);
    }
}

void main() {
    int place = u_part.x + int(gl_GlobalInvocationID.x);
    if (place >= u_part.y) return;
    uint chosen = texelFetch(u_chosen, place).r;
    uvec4 corners = texelFetch(u_corners, int(chosen & 0x3fffffffu));
    vec3 a = texelFetch(u_positions, int(corners.x)).xyz, b = texelFetch(u_positions, int(corners.y)).xyz, c = texelFetch(u_positions, int(corners.z)).xyz;
    draw_direction(0, a, b, c, chosen); // not a loop: constant indices are read once for all triangles that are drawn together
    draw_direction(1, a, b, c, chosen);
    draw_direction(2, a, b, c, chosen);
    draw_direction(3, a, b, c, chosen);
    draw_direction(4, a, b, c, chosen);
    draw_direction(5, a, b, c, chosen);
    draw_direction(6, a, b, c, chosen);
    draw_direction(7, a, b, c, chosen);
}
