// The point over a flat triangle from which a smooth mesh sees the light, and the normal there: Hanika 2021, "Hacking the Shadow
// Terminator", Ray Tracing Gems II, chapter 4. Over facets of a convex surface the point lies outside them, elsewhere on them. It is moved
// all the way where the facet faces away from the light, and not at all where it is well lit. Twin: glshadow.geometry.smooth
// Needs lib/octahedral.glsl
// per drawn triangle: its vertices' world normals; bits: 1: not flat, 2: the normals oppose its winding, upper 16: the share by which
// points are moved
uniform usamplerBuffer u_smooth;

const float SMOOTH_FADE = 0.1; // cosine to the light above which points are not moved

struct SmoothPoint {
    vec3 position;
    vec3 normal; // unit; of a flat triangle the face normal
    bool smooth_; // the triangle is not flat
    bool lifted; // off the triangle by more than rounding, so that the triangle itself may block the ray
};

// face: the triangle's unit normal on the visible side, which is side (1 or -1) times that of its winding; cosine: between it and the
// lowest direction to the light; axes: from world axes
SmoothPoint smooth_point(int triangle, vec3 position, vec3 face, float side, float cosine, mat3 corners, mat3 axes, float rounding) {
    uvec4 bits = texelFetch(u_smooth, triangle);
    SmoothPoint found = SmoothPoint(position, face, bits.w != 0u, false);
    for (uint turn = bits.w & 1u; turn != 0u; turn >>= 1u) { // a loop, since llvmpipe skips no `if`
        vec3 e = corners[1] - corners[0], f = corners[2] - corners[0], p = position - corners[0];
        float area = dot(cross(e, f), face);
        vec2 share = vec2(dot(cross(p, f), face), dot(cross(e, p), face)) / (area == 0.0 ? 1.0 : area);
        vec3 weight = clamp(vec3(1.0 - share.x - share.y, share), 0.0, 1.0);
        weight /= weight.x + weight.y + weight.z;
        mat3 normals = axes * mat3(unpack_octahedral(bits.x), unpack_octahedral(bits.y), unpack_octahedral(bits.z));
        normals *= (bits.w & 2u) != 0u ? -side : side;
        vec3 below = max(-vec3(dot(p, normals[0]), dot(position - corners[1], normals[1]), dot(position - corners[2], normals[2])), 0.0);
        float moved = float(bits.w >> 16u) / 65535.0 * clamp(1.0 - cosine / SMOOTH_FADE, 0.0, 1.0);
        vec3 offset = normals * (weight * below) * moved;
        found.lifted = dot(offset, face) > rounding;
        found.position = found.lifted ? position + offset : position;
        found.normal = normalize(normals * weight);
    }
    return found;
}
