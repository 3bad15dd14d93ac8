// Copies a texture to the viewport, which begins in a row of its own.
uniform sampler2D u_copied;
uniform int u_row; // first row of the viewport
layout(location = 0) out vec4 o_copy;

void main() {
    o_copy = texelFetch(u_copied, ivec2(gl_FragCoord.xy) - ivec2(0, u_row), 0);
}
