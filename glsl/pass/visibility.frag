// Visibility of one light alone, by an exact filter, at the middle of each pixel.
#include "lib/surface_number.glsl"
#include <light>
#include <shadow>
#include "lib/asked.glsl"
#include "lib/sight.glsl"
#include "lib/surface_point.glsl"
uniform usampler2D u_surface;
flat in vec3 v_forward_l; // see resolve.vert
layout(location = 0) out float o_visibility;

void main() {
    uint number = texelFetch(u_surface, ivec2(gl_FragCoord.xy), 0).r;
    receiver_triangle = triangle_of(number);
    Facet own = facet(receiver_triangle);
    receiver_corner = plane_corner(own);
    vec3 position = surface_point(receiver_triangle, own, v_eye_l, v_ray_l, v_forward_l);
    vec3 normal = dot(own.normal, v_ray_l) > 0.0 ? -own.normal : own.normal;
    float cosine = dot(normal, light_arriving(position).xyz);
    o_visibility = asked_visibility(number, position, normal, cosine);
}
