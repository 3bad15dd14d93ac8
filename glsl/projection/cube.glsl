// A point light: the face is selected by the dominant axis, then as for a spot. position_lv is relative to the light, in world axes.
// Faces +x -x +y -y +z -z are signed permutations of the axes. Twin: glshadow.shadows.view.FACES
#include "lib/faces.glsl"
uniform vec4 u_texel_from_lv; // texel in its tile = xy * tangent + zw
uniform vec3 u_base;           // depth as the map stores it = a constant + base: its factor, and that of its slope along x and y
uniform vec2 u_allowance;     // reduction of a receiver's distance: world units, and a share of the distance
uniform vec2 u_face_tile[6]; // corner of each face's tile in the atlas
#define GLS_LEAST_COSINE 1e-7 // edge-on receivers are unlit anyway

vec3 turned(vec3 v, float axis, float s) { // into the frame of the face: lib/faces.glsl, multiplied out
    return axis < 0.5 ? vec3(s * v.z, v.y, -s * v.x) : axis < 1.5 ? vec3(v.x, s * v.z, -s * v.y) : vec3(-s * v.x, v.y, -s * v.z);
}

// Into the axes of the face that sees a position.
vec3 map_axes(vec3 v, vec3 position_lv) {
    float axis = face_axis(position_lv);
    return turned(v, axis, face_side(position_lv, axis));
}

Receiver project_receiver(vec3 position_lv, vec3 normal_lv) {
    float axis = face_axis(position_lv);
    float s = face_side(position_lv, axis);
    vec3 position = turned(position_lv, axis, s);
    vec3 normal = turned(normal_lv, axis, s);
    float face = face_number(axis, s);
    vec2 tile = u_face_tile[0];
    for (int i = 1; i < 6; i++) {
        if (face == float(i)) tile = u_face_tile[i];
    }
    Receiver receiver;
    receiver.depth = u_base.x / max(-position.z * (1.0 - u_allowance.y) - u_allowance.x, 1e-30);
    receiver.tangent = position.xy / max(-position.z, 1e-30);
    receiver.texel = receiver.tangent * u_texel_from_lv.xy + u_texel_from_lv.zw + tile;
    float plane = -max(-dot(normal, position), GLS_LEAST_COSINE * length(position));
    receiver.slope = normal.xy * u_base.yz * (1.0 / plane);
    return receiver;
}

bool receiver_in_front(vec3 position_lv) {
    return true;
}
