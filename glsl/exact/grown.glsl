// Lists of grown items: a receiver walks the list of its cell in the finest grid, which continues with those of the coarser grids. See
// lib/cells.glsl and pass/chain.comp.
#ifndef GLS_CELLS
#define GLS_CELLS 512
#endif
#ifndef GLS_GROWN
#define GLS_GROWN 256
#endif
#ifndef GLS_POINT
#define GLS_POINT 0
#endif
#ifndef GLS_AT_INFINITY
#define GLS_AT_INFINITY 0
#endif
uniform usampler2D u_grown_heads;
uniform usamplerBuffer u_grown_links;

struct Place { // in the grids
    ivec2 cell; // of the finest grid
    int top; // first row of the face
    float depth;
    bool inside;
};

Place place_of(vec3 position) {
    Place p;
    p.top = 0;
    p.depth = -position.z;
    p.inside = true;
    vec2 place = position.xy;
#if GLS_POINT
    float axis = face_axis(position), s = face_side(position, axis);
    p.top = int(face_number(axis, s)) * 2 * GLS_GROWN;
    p.depth = -dot(face_backward(axis, s), position);
    place = vec2(dot(face_right(axis, s), position), dot(face_up(axis, s), position));
#elif !GLS_AT_INFINITY
    p.inside = p.depth > 0.0;
#endif
#if !GLS_AT_INFINITY
    place /= max(p.depth, 1e-30);
#endif
    vec2 cell = (place * u_cells.xy + u_cells.zw) * (float(GLS_GROWN) / float(GLS_CELLS));
#if !GLS_POINT
    p.inside = p.inside && all(greaterThanEqual(cell, vec2(0.0))) && all(lessThan(cell, vec2(GLS_GROWN)));
#endif
    p.cell = clamp(ivec2(cell), ivec2(0), ivec2(GLS_GROWN - 1));
    return p;
}

uint head_at(Place p) {
    uint head = texelFetch(u_grown_heads, p.cell + ivec2(0, p.top), 0).r;
    return p.inside ? head : 0u;
}
