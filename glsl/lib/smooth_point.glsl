// The point over a flat triangle from which a smooth mesh sees the light, and the normal there: Hanika 2021, "Hacking the Shadow
// Terminator", Ray Tracing Gems II, chapter 4. Over facets of a convex surface it lies outside them, elsewhere on them. Twin:
// glshadow.core.smooth.lift
#include "lib/octahedral.glsl"
uniform usamplerBuffer u_smooth; // per drawn triangle: its vertices' world normals; 0: it is flat, 1: they look as it does, 2: against it

struct SmoothPoint {
    vec3 position;
    vec3 normal; // unit; of a flat triangle its own
    bool smooth_; // the triangle is not flat
    bool lifted; // off the triangle by more than rounding: then the triangle itself may come between
};

// face: the triangle's unit normal on the side that is seen, which is side (1 or -1) times that of its winding; axes: from world axes
SmoothPoint smooth_point(int triangle, vec3 position, vec3 face, float side, mat3 corners, mat3 axes, float rounding) {
    uvec4 bits = texelFetch(u_smooth, triangle);
    vec3 e = corners[1] - corners[0], f = corners[2] - corners[0], p = position - corners[0];
    float area = dot(cross(e, f), face);
    vec2 share = vec2(dot(cross(p, f), face), dot(cross(e, p), face)) / (area == 0.0 ? 1.0 : area);
    vec3 weight = clamp(vec3(1.0 - share.x - share.y, share), 0.0, 1.0);
    weight /= weight.x + weight.y + weight.z;
    mat3 normals = axes * mat3(unpack_octahedral(bits.x), unpack_octahedral(bits.y), unpack_octahedral(bits.z));
    normals *= bits.w == 2u ? -side : side;
    vec3 below = max(-vec3(dot(p, normals[0]), dot(position - corners[1], normals[1]), dot(position - corners[2], normals[2])), 0.0);
    vec3 offset = normals * (weight * below);
    SmoothPoint found;
    found.smooth_ = bits.w != 0u;
    found.lifted = found.smooth_ && dot(offset, face) > rounding;
    found.position = found.lifted ? position + offset : position;
    found.normal = found.smooth_ ? normalize(normals * weight) : face;
    return found;
}
