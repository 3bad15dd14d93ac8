// A camera's or a light's view of capsules: axes right, up and forward, from its eye. Twin: glshadow.gl.passes.capsules
uniform mat3 u_view; // from world axes
uniform vec3 u_eye; // relative to the scene's origin
uniform vec3 u_eye_rest; // what float cuts off
uniform vec4 u_window; // half width and height, middle: tangents, or of an orthographic view world units

vec3 in_view(vec4 place) { // w: see lib/ray_triangle.glsl
    vec3 size = abs(place.xyz);
    uint largest = floatBitsToUint(max(size.x, max(size.y, size.z))), bits = uint(place.w);
    float unit = uintBitsToFloat(largest & 0x7f800000u) * exp2(-31.0);
    vec3 rest = (vec3(uvec3(bits, bits >> 8u, bits >> 16u) & 255u) - 128.0) * unit;
    return u_view * ((place.xyz - u_eye) + (rest - u_eye_rest));
}
