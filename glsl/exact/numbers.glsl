// Slot <candidates>: the triangles nearest the light in the 4 x 4 texels round the receiver, from a map of their numbers: OpenGL 3.3.
// Needs lib/surface_number.glsl. Each is asked exactly, but a triangle that no texel's centre saw is missed, and a cut-out one counts wherever its own texels did.
#ifndef GLS_CELLS
#define GLS_CELLS 2048
#endif
uniform usampler2D u_numbers; // 0: nothing there

bool blocked(Ray ray, vec2 cell, float face, float depth, bool asked) {
    ivec2 corner = ivec2(floor(cell - 1.5));
    bool dark = false;
    int count = asked ? 16 : 0;
    int before = -1;
    for (int i = 0; i < count; i++) {
        ivec2 texel = clamp(corner + ivec2(i & 3, i >> 2), ivec2(0), ivec2(GLS_CELLS - 1));
        int triangle = triangle_of(texelFetch(u_numbers, texel + ivec2(0, int(face) * GLS_CELLS), 0).r);
        if (triangle < 0 || triangle == receiver_triangle || triangle == before) continue;
        before = triangle;
        Facet other = facet(triangle);
        if (!met(turns(across(ray, other.a), across(ray, other.b), across(ray, other.c)))) continue;
        if (behind(ray, other) > 0) {
            dark = true;
            count = 0;
        }
    }
    return dark;
}
