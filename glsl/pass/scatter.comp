// Writes the counts of listed texels to where they belong.
layout(local_size_x = 64) in;
uniform usamplerBuffer u_places; // x | y << 16
uniform ivec3 u_batch; // first of the batch, number, columns of u_found
uniform usampler2D u_found;
uniform int u_unit; // of a count, in the target
layout(r32ui, binding = 0) writeonly uniform uimage2D u_counts;

void main() {
    int number = int(gl_GlobalInvocationID.x);
    if (number >= u_batch.y) return;
    uint bits = texelFetch(u_places, u_batch.x + number).r;
    uint found = texelFetch(u_found, ivec2(number % u_batch.z, number / u_batch.z), 0).r;
    imageStore(u_counts, ivec2(int(bits & 0xffffu), int(bits >> 16u)), uvec4(found * uint(u_unit)));
}
