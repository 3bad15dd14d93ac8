// Links a capsule into the per-cell lists of lib/cells.glsl: the box around its projection, and for a tube the strip along it.
#ifndef GLS_CAPSULES
#define GLS_CAPSULES 0 // 1: the scene has balls; 2: also tubes
#endif
#ifndef GLS_CELLS
#define GLS_CELLS 512 // along a side of the fine grid
#endif
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
const float WIDER = 1.00001; // rounding, relative

// Bounds of a ball's projection along one axis, as tangents: x across, w > r along the view, both of its centre.
vec2 tangents(float x, float w, float r) {
    float across = sqrt(max(x * x + w * w - r * r, 0.0)) * r, below = w * w - r * r;
    return vec2(x * w - across, x * w + across) / below;
}

Footprint capsule_footprint(Capsule c) { // in the face's frame, z backward
    Footprint f;
    f.round_ = true;
    f.crosses = false;
    f.slant = 1.0;
    f.p = f.q = f.r = vec2(0.0);
    f.sides = mat3(vec3(0.0), vec3(0.0), vec3(0.0));
    float r = c.radius * WIDER;
    f.depth = vec3(-c.a.z, -c.b.z, -c.b.z);
    f.nearest = min(f.depth.x, f.depth.y) - r;
    f.nearest -= 1e-6 * (abs(f.nearest) + r);
#if GLS_AT_INFINITY
    vec2 least = min(c.a.xy, c.b.xy) - r, most = max(c.a.xy, c.b.xy) + r;
    f.least = least * u_cells.xy + u_cells.zw;
    f.most = most * u_cells.xy + u_cells.zw;
#if GLS_CAPSULES == 2
    vec2 along = c.b.xy - c.a.xy;
    float size = length(along);
    vec2 side = size > 0.0 ? vec2(-along.y, along.x) / size : vec2(0.0);
    f.sides[0] = vec3(side, r - dot(side, c.a.xy));
    f.sides[1] = vec3(-side, r + dot(side, c.a.xy));
#endif
#else
    bool ahead = f.nearest > 1e-3 * r;
    f.nearest = max(f.nearest, 0.0);
    if (ahead) {
        vec2 ax = tangents(c.a.x, f.depth.x, r), ay = tangents(c.a.y, f.depth.x, r);
        vec2 bx = tangents(c.b.x, f.depth.y, r), by = tangents(c.b.y, f.depth.y, r);
        f.least = vec2(min(ax.x, bx.x), min(ay.x, by.x)) * u_cells.xy + u_cells.zw;
        f.most = vec2(max(ax.y, bx.y), max(ay.y, by.y)) * u_cells.xy + u_cells.zw;
    } else { // beside or around the light: any cell
        f.least = vec2(0.0);
        f.most = vec2(GLS_CELLS);
    }
#if GLS_CAPSULES == 2
    // planes through the light that touch both balls: unit n with n.a = n.b = r; directions (x, y, -1) inside have n.(x, y, -1) >= 0
    float aa = dot(c.a, c.a), ab = dot(c.a, c.b), bb = dot(c.b, c.b);
    vec3 out_ = cross(c.a, c.b);
    float det = dot(out_, out_);
    if (ahead && det > 1e-8 * aa * bb) {
        vec3 flat_ = (c.a * (bb - ab) + c.b * (aa - ab)) * (r / det);
        float rest = 1.0 - dot(flat_, flat_);
        if (rest > 0.0) {
            out_ *= sqrt(rest / det);
            vec3 one = flat_ + out_, two = flat_ - out_;
            f.sides[0] = vec3(one.xy, -one.z);
            f.sides[1] = vec3(two.xy, -two.z);
        }
    }
#endif
#endif
    return f;
}

const uint CAPSULE_LINK = 0xffffffffu; // in place of a mask

void insert_capsule(uint item, Capsule c) {
    for (int face = 0; face < FACES; face++) {
        mat3 turned = face_from_lv(face);
        Capsule seen = Capsule(turned * c.a, turned * c.b, c.radius);
        if (!near_window(seen.a, seen.b, seen.b, 1.01 * seen.radius)) continue;
        insert(item, CAPSULE_LINK, face, capsule_footprint(seen));
    }
}
