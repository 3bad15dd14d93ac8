// Rays from a receiver to some directions of light against the triangles near it, and where a map is looked up instead, so that its texel's
// centre is not beyond such a triangle. Lists of cells: glshadow.derive.near_casters. Exact up to float32: neighbours share edges' signs.
uniform usamplerBuffer u_near_heads; // per cell: first link, number of links; bit 31 of it: all that is near is listed
uniform usamplerBuffer u_near_links; // triangles
uniform samplerBuffer u_near_corners; // three for each triangle, relative to the middle of the casters
uniform samplerBuffer u_towards; // unit directions, in the order of u_directions
uniform vec4 u_near_grid; // corner, cells in a unit
uniform vec3 u_near_cells; // along x, y, z
uniform vec3 u_near_reach; // a texel; rounding; distance up to which triangles are tested: world units
uniform vec4 u_near_horizon; // axis of a hemisphere that holds all directions and the rounding; 0 0 0 -1: there is none

const float STEEP = 0.5; // a wall rises by more than 30 degrees from the receiver

uvec2 near_list(vec3 start) {
    vec3 at = clamp(floor((start - u_near_grid.xyz) * u_near_grid.w), vec3(0.0), u_near_cells - 1.0);
    return texelFetch(u_near_heads, int((at.z * u_near_cells.y + at.y) * u_near_cells.x + at.x)).rg;
}

bool is_complete(uvec2 list) { // it holds all triangles up to u_near_reach.z
    return list.y >= 0x80000000u;
}

// Bits of `count` directions from `first` on that are blocked; `aside`: moves away from walls, along the receiver's plane.
uint near_blocked(uvec2 list, vec3 start, vec3 normal, int first, int count, inout vec3 aside) {
    uint blocked = 0u, end = list.x + (list.y & 0x7fffffffu);
    for (uint link = list.x; link < end; link++) {
        int corner = 3 * int(texelFetch(u_near_links, int(link)).r);
        vec3 a = texelFetch(u_near_corners, corner).xyz - start, b = texelFetch(u_near_corners, corner + 1).xyz - start;
        vec3 c = texelFetch(u_near_corners, corner + 2).xyz - start;
        vec3 apart = max(max(min(min(a, b), c), -max(max(a, b), c)), vec3(0.0)); // of its box
        bool above = dot(apart, apart) < u_near_reach.z * u_near_reach.z && max(max(dot(normal, a), dot(normal, b)), dot(normal, c)) > u_near_reach.y; 
        bool high = max(max(dot(u_near_horizon.xyz, a), dot(u_near_horizon.xyz, b)), dot(u_near_horizon.xyz, c)) > u_near_horizon.w;
        vec3 ab = cross(a, b), bc = cross(b, c), ca = cross(c, a), wide = ab + bc + ca;
        float area = length(wide), volume = dot(a, bc), bound = u_near_reach.y * area;
        bool front = volume > -bound, back = volume < bound; // both: in its plane
        vec3 outward = wide * ((volume > 0.0 ? -1.0 : 1.0) / max(area, 1e-30));
        vec3 along = outward - normal * dot(normal, outward);
        float inside = min(min(dot(ab, wide), dot(bc, wide)), dot(ca, wide)), steep = dot(along, along);
        bool wall = above && steep > STEEP * STEEP && inside > -0.02 * area * area;
        float missing = u_near_reach.x + dot(outward, a - aside);
        aside += wall ? along * (clamp(missing, 0.0, u_near_reach.x) / steep) : vec3(0.0);
        int last = above && high ? count : 0; // a loop, since llvmpipe skips no `if`
        for (int i = 0; i < last; i++) {
            vec3 towards = texelFetch(u_towards, first + i).xyz;
            vec3 turns = vec3(dot(ab, towards), dot(bc, towards), dot(ca, towards));
            bool hit = front && min(min(turns.x, turns.y), turns.z) >= 0.0 || back && max(max(turns.x, turns.y), turns.z) <= 0.0;
            blocked |= hit ? 1u << uint(i) : 0u;
        }
    }
    return blocked;
}
