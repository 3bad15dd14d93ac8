// Enlarges triangles on the screen by more than GL's snapping may move their edges, so that each covers all pixels whose rays hit it;
// pass/surface.frag then tests the rays. The corners' attributes are passed flat, for all three corners.
#ifndef GLS_TEXTURED
#define GLS_TEXTURED 0
#endif
#ifndef GLS_COLORED
#define GLS_COLORED 0
#endif
#ifndef GLS_SMOOTH
#define GLS_SMOOTH 0
#endif
#ifndef GLS_SETS
#define GLS_SETS 0
#endif
#ifndef GLS_NORMAL_MAP
#define GLS_NORMAL_MAP 0
#endif
layout(triangles) in;
layout(triangle_strip, max_vertices = 4) out;
uniform vec2 u_half_size; // of the image, in pixels
uniform float u_least_w; // clip w of the near plane, or less
uniform float u_side; // more than 0, less: fronts are seen counterclockwise, clockwise
uniform bool u_hidden; // backs are
uniform float u_nudge; // relative, away from the eye: more than depths are rounded
flat in int v_triangle[];
flat out int t_triangle;
#if GLS_SMOOTH
#if GLS_NORMAL_MAP == 3
flat
#endif
in vec3 v_normal_w[];
flat out vec3 t_normal_w[3];
#endif
#if GLS_TEXTURED
in vec2 v_uv[];
flat out vec2 t_uv[3];
#endif
#if GLS_COLORED
in vec4 v_color[];
flat out vec4 t_color[3];
#endif
#if GLS_SETS
in vec4 v_sets[];
flat out vec4 t_sets[3];
#endif
#if GLS_NORMAL_MAP
#if GLS_NORMAL_MAP > 1
flat
#endif
in vec4 v_tangent_w[];
flat out vec4 t_tangent_w[3];
flat in float v_side[];
flat out float t_side;
#endif
const float GROWN = 1.0 / 128.0; // pixels
const float SNAPPED = 256.0; // subpixel positions per pixel
const float THIN = 4.0 * GROWN; // radius of the inscribed circle: moved sides of thinner triangles would meet far away
const float WIDE = 16.0; // NDC: beyond, rounding exceeds a part of a pixel

vec2 corners[4];

void emit(vec2 place, vec3 start, vec2 slope) { // start: pixels and NDC z
    place = round(place * SNAPPED) / SNAPPED; // snaps as GL would, so that depth does not change with it
    gl_Position = vec4(place / u_half_size, start.z + dot(slope, place - start.xy), 1.0);
    t_triangle = v_triangle[2];
    for (int k = 0; k < 3; k++) {
#if GLS_NORMAL_MAP == 3
        t_normal_w[k] = v_normal_w[2];
#elif GLS_SMOOTH
        t_normal_w[k] = v_normal_w[k];
#endif
#if GLS_TEXTURED
        t_uv[k] = v_uv[k];
#endif
#if GLS_COLORED
        t_color[k] = v_color[k];
#endif
#if GLS_SETS
        t_sets[k] = v_sets[k];
#endif
#if GLS_NORMAL_MAP > 1
        t_tangent_w[k] = v_tangent_w[2]; // a triangle's is with its last vertex
#elif GLS_NORMAL_MAP
        t_tangent_w[k] = v_tangent_w[k];
#endif
    }
#if GLS_NORMAL_MAP
    t_side = v_side[2];
#endif
    EmitVertex();
}

float left_of(vec2 place, vec2 start, vec2 end) {
    return (end.x - start.x) * (place.y - start.y) - (end.y - start.y) * (place.x - start.x);
}

bool holds(vec2 place, int count) {
    int after = count == 4 ? 3 : 2; // corners are in triangle strip order
    vec3 sides = vec3(left_of(place, corners[0], corners[1]), left_of(place, corners[1], corners[after]), left_of(place, corners[2], corners[0]));
    float last = count == 4 ? left_of(place, corners[3], corners[2]) : sides.z;
    return min(min(sides.x, sides.y), min(sides.z, last)) >= 0.0 || max(max(sides.x, sides.y), max(sides.z, last)) <= 0.0;
}

void main() {
    vec4 a = gl_in[0].gl_Position, b = gl_in[1].gl_Position, c = gl_in[2].gl_Position;
    vec3 bc = cross(b.xyw, c.xyw), ca = cross(c.xyw, a.xyw), ab = cross(a.xyw, b.xyw);
    float volume = dot(a.xyw, bc); // more than 0: counterclockwise
    bool back = volume * u_side < 0.0;
    if (volume == 0.0 || back && u_hidden) return;
    vec3 start; // a point of its plane, in pixels and NDC z
    vec2 slope; // of z per pixel
    vec3 most = max(abs(a.xyw), max(abs(b.xyw), abs(c.xyw)));
    vec2 p = a.xy / a.w, q = b.xy / b.w, r = c.xy / c.w;
    vec2 farthest = max(abs(p), max(abs(q), abs(r)));
    int count = 4;
    if (min(a.w, min(b.w, c.w)) < u_least_w || !(max(farthest.x, farthest.y) < WIDE)) { // a box around the part in front of the eye
        vec3 plane = (bc * a.z + ca * b.z + ab * c.z) / volume;
        start = vec3(0.0, 0.0, plane.z);
        slope = plane.xy / u_half_size;
        vec2 low = vec2(1e30), high = vec2(-1e30);
        for (int k = 0; k < 3; k++) {
            vec4 here = gl_in[k].gl_Position, next = gl_in[k == 2 ? 0 : k + 1].gl_Position;
            if (here.w >= u_least_w) {
                low = min(low, here.xy / here.w);
                high = max(high, here.xy / here.w);
            }
            if ((here.w >= u_least_w) != (next.w >= u_least_w)) {
                vec2 edge = mix(here.xy, next.xy, (u_least_w - here.w) / (next.w - here.w)) / u_least_w;
                float rounding = 1e-6 * max(most.x, max(most.y, most.z)) / u_least_w;
                low = min(low, edge - rounding);
                high = max(high, edge + rounding);
            }
        }
        low = max(low, vec2(-2.0)) * u_half_size - GROWN;
        high = min(high, vec2(2.0)) * u_half_size + GROWN;
        if (!(low.x < high.x && low.y < high.y)) return;
        corners = vec2[4](low, vec2(high.x, low.y), vec2(low.x, high.y), high);
    } else {
        p *= u_half_size;
        q *= u_half_size;
        r *= u_half_size;
        vec3 sides = vec3(distance(q, r), distance(r, p), distance(p, q)); // opposite p, q, r
        float around = sides.x + sides.y + sides.z;
        vec3 side = vec3(q - p, b.z / b.w - a.z / a.w), other = vec3(r - p, c.z / c.w - a.z / a.w);
        vec3 normal = cross(side, other);
        start = vec3(p, a.z / a.w);
        slope = -normal.xy / (normal.z == 0.0 ? 1.0 : normal.z);
        float radius = abs(normal.z) / max(around, 1e-30);
        if (radius > THIN) { // sides moved outwards
            vec2 middle = (p * sides.x + q * sides.y + r * sides.z) / around;
            float grown = 1.0 + GROWN / radius;
            corners = vec2[4](middle + grown * (p - middle), middle + grown * (q - middle), middle + grown * (r - middle), vec2(0.0));
            count = 3;
        } else { // a rectangle along its longest side
            vec2 start = p, end = q, apex = r;
            if (sides.x >= sides.y && sides.x >= sides.z) {
                start = q;
                end = r;
                apex = p;
            } else if (sides.y >= sides.z) {
                start = r;
                end = p;
                apex = q;
            }
            float length_ = max(sides.x, max(sides.y, sides.z));
            vec2 along = length_ > 0.0 ? (end - start) / length_ : vec2(1.0, 0.0), across = vec2(-along.y, along.x);
            float height = dot(apex - start, across);
            vec2 low = across * (min(height, 0.0) - GROWN), high = across * (max(height, 0.0) + GROWN);
            start -= along * GROWN;
            end += along * GROWN;
            corners = vec2[4](start + low, end + low, start + high, end + high);
        }
    }
    vec2 low = min(corners[0], min(corners[1], corners[2])), high = max(corners[0], max(corners[1], corners[2]));
    if (count == 4) {
        low = min(low, corners[3]);
        high = max(high, corners[3]);
    }
    // skip triangles that contain no pixel centre
    vec2 first = ceil(low + u_half_size - 0.5), last = floor(high + u_half_size - 0.5);
    if (any(greaterThan(first, last)) || first == last && !holds(first + 0.5 - u_half_size, count)) return;
    // beside the edge of a front and a back their depths are too close to tell, and the front is the nearer
    start.z += (back ? 2.0 : 1.0) * u_nudge * abs(start.z);
    bool turned = count == 4 && volume < 0.0; // the winding stays
    emit(corners[turned ? 1 : 0], start, slope);
    emit(corners[turned ? 0 : 1], start, slope);
    emit(corners[turned ? 3 : 2], start, slope);
    if (count == 4) emit(corners[turned ? 2 : 3], start, slope);
    EndPrimitive();
}
