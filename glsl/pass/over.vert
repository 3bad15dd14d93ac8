// One triangle over the whole viewport.
const vec2 corner[3] = vec2[3](vec2(-1.0, -1.0), vec2(3.0, -1.0), vec2(-1.0, 3.0));

void main() {
    gl_Position = vec4(corner[gl_VertexID], 0.0, 1.0);
}
