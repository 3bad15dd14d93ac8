// The six faces of a point light, +x -x +y -y +z -z: right, up and backward axis of the face along s * axis (0 x, 1 y, 2 z) are
// signed world axes, so that a face changes no coordinate's bits. Twin: glshadow.shadows.view.FACES
float face_axis(vec3 direction) { // the longest one; the first of equal ones
    vec3 size = abs(direction);
    return size.x >= size.y && size.x >= size.z ? 0.0 : size.y >= size.z ? 1.0 : 2.0;
}

float face_side(vec3 direction, float axis) {
    return (axis < 0.5 ? direction.x : axis < 1.5 ? direction.y : direction.z) < 0.0 ? -1.0 : 1.0;
}

float face_number(float axis, float s) {
    return 2.0 * axis + (s < 0.0 ? 1.0 : 0.0);
}

vec3 face_right(float axis, float s) {
    return axis < 0.5 ? vec3(0.0, 0.0, s) : axis < 1.5 ? vec3(1.0, 0.0, 0.0) : vec3(-s, 0.0, 0.0);
}

vec3 face_up(float axis, float s) {
    return axis < 0.5 ? vec3(0.0, 1.0, 0.0) : axis < 1.5 ? vec3(0.0, 0.0, s) : vec3(0.0, 1.0, 0.0);
}

vec3 face_backward(float axis, float s) {
    return axis < 0.5 ? vec3(-s, 0.0, 0.0) : axis < 1.5 ? vec3(0.0, -s, 0.0) : vec3(0.0, 0.0, -s);
}
