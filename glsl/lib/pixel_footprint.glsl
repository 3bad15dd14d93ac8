// The part of a receiver's plane that a pixel's samples see, bounded by a parallelogram around the pixel's centre.
#ifndef GLS_ORTHO
#define GLS_ORTHO 0
#endif
#include "lib/mixed.glsl"
uniform vec4 u_sampled; // pixels: half of what the samples span, right and up; from the pixel's middle to the sample that is shown
uniform usampler2D u_mixed; // see lib/mixed.glsl
const float MOST_FORESHORTENED = 0.9; // nearer to the plane's horizon no parallelogram holds what is seen

struct PixelFootprint {
    vec3 middle;
    vec3 right; // half vectors along the sides
    vec3 up;
    vec3 normal; // of the plane, on the side that is seen
    float pixel; // its size across the ray
    float off; // world units: how far off the plane other samples see the surface, and
    vec3 aside; // along their rays
    bool open; // reaches to the horizon
    bool mixed; // the samples are shaded one by one anyway
};

PixelFootprint pixel_footprint(vec3 position, vec3 normal, vec3 eye, vec3 ray) { // ray: of unit view depth
    PixelFootprint f;
#if GLS_ORTHO
    vec3 right = dFdx(eye), up = dFdy(eye);
#else
    float depth = dot(position - eye, ray) / dot(ray, ray);
    vec3 right = depth * dFdx(ray), up = depth * dFdy(ray);
#endif
    float slant = dot(normal, ray);
    vec2 along = vec2(dot(normal, right), dot(normal, up)) / slant;
    f.normal = normal;
    f.pixel = max(length(right), length(up));
    right -= ray * along.x;
    up -= ray * along.y;
    f.middle = position - right * u_sampled.z - up * u_sampled.w;
#if GLS_ORTHO
    float foreshortened = 0.0;
#else
    float foreshortened = dot(abs(along), u_sampled.xy + abs(u_sampled.zw)) / depth;
#endif
    f.open = !(foreshortened < MOST_FORESHORTENED);
    float grown = 1.0 / (1.0 - min(foreshortened, MOST_FORESHORTENED));
    vec2 reach = u_sampled.xy * grown + abs(u_sampled.zw) * (grown - 1.0); // the plane is seen foreshortened from the sample shown on
    f.right = right * reach.x;
    f.up = up * reach.y;
    uint mixed = texelFetch(u_mixed, ivec2(gl_FragCoord.xy), 0).r;
    f.mixed = mixed == MIXED;
    f.off = off_plane(mixed) * f.pixel * grown;
    f.aside = ray * (f.off * grown / (slant == 0.0 ? 1.0 : slant));
    return f;
}
