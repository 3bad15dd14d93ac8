// A triangle's vertices and unit normal in a light's frame, each rounded once and equal for every copy of a vertex. Computed in double, or
// in pairs of floats if the driver lacks double. The normal is computed from the vertices before rotation, whose rounding would decide
// which side of a triangle a grazing directional light sees.
#ifndef GLS_DOUBLE
#define GLS_DOUBLE 1 // 0: the driver has none
#endif
#if GLS_DOUBLE

vec3 placed(vec3 point, vec3 origin, mat3 axes) {
    return vec3(dmat3(axes) * (dvec3(point) - dvec3(origin)));
}

vec3 unit_normal(vec3 a, vec3 b, vec3 c, mat3 axes) { // of vertices in world axes; 0 where there is no area
    dvec3 e = dvec3(b) - dvec3(a), f = dvec3(c) - dvec3(a);
    dvec3 product = dvec3(e.y * f.z - e.z * f.y, e.z * f.x - e.x * f.z, e.x * f.y - e.y * f.x);
    double size = dot(product, product);
    return size > 0.0 ? vec3(dmat3(axes) * (product / sqrt(size))) : vec3(0.0);
}

#else
#include "lib/double_float.glsl"

vec3 turned(vec2 x, vec2 y, vec2 z, mat3 axes) {
    vec3 result;
    for (int i = 0; i < 3; i++) {
        vec2 sum = double_float_sum(double_float_product(vec2(axes[0][i], 0.0), x), double_float_product(vec2(axes[1][i], 0.0), y));
        result[i] = double_float_sum(sum, double_float_product(vec2(axes[2][i], 0.0), z)).x;
    }
    return result;
}

vec3 placed(vec3 point, vec3 origin, mat3 axes) {
    return turned(exact_sum(point.x, -origin.x), exact_sum(point.y, -origin.y), exact_sum(point.z, -origin.z), axes);
}

vec2 minor(vec2 a, vec2 b, vec2 c, vec2 d) { // a b - c d
    vec2 subtracted = double_float_product(c, d);
    return double_float_sum(double_float_product(a, b), -subtracted);
}

vec3 unit_normal(vec3 a, vec3 b, vec3 c, mat3 axes) { // of vertices in world axes; 0 where there is no area
    vec3 longest = max(abs(b - a), abs(c - a));
    int scale;
    frexp(max(longest.x, max(longest.y, longest.z)), scale); // prevents underflow
    vec2 e[3], f[3];
    for (int i = 0; i < 3; i++) {
        e[i] = ldexp(exact_sum(b[i], -a[i]), ivec2(-scale));
        f[i] = ldexp(exact_sum(c[i], -a[i]), ivec2(-scale));
    }
    vec2 n[3] = vec2[3](minor(e[1], f[2], e[2], f[1]), minor(e[2], f[0], e[0], f[2]), minor(e[0], f[1], e[1], f[0]));
    float largest = max(abs(n[0].x), max(abs(n[1].x), abs(n[2].x)));
    if (!(largest > 0.0)) return vec3(0.0);
    frexp(largest, scale);
    for (int i = 0; i < 3; i++) n[i] = ldexp(n[i], ivec2(-scale));
    vec2 size = double_float_sum(double_float_sum(double_float_product(n[0], n[0]), double_float_product(n[1], n[1])), double_float_product(n[2], n[2]));
    vec2 root = vec2(inversesqrt(size.x), 0.0); // then a Newton step: r + r (1 - size r^2) / 2
    vec2 rest = double_float_sum(vec2(1.0, 0.0), -double_float_product(size, double_float_product(root, root)));
    root = double_float_sum(root, 0.5 * double_float_product(root, rest));
    return turned(double_float_product(n[0], root), double_float_product(n[1], root), double_float_product(n[2], root), axes);
}

#endif
