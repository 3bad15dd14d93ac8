// Per-sample buffers are packed: one block of samples for each collected pixel, block after block in rows. Needs core330.
#ifndef GLS_COLUMNS
#define GLS_COLUMNS 2 // of a block, which holds the samples of one pixel
#endif
#ifndef GLS_ROWS
#define GLS_ROWS 2
#endif
uniform usamplerBuffer u_pixels; // collected pixels: x | y << 16
uniform ivec3 u_batch; // first pixel of the batch, number of pixels, blocks in a row
const ivec2 BLOCK = ivec2(GLS_COLUMNS, GLS_ROWS);

ivec2 sample_texel(ivec2 fragment) { // in the buffer with all samples of the image
    ivec2 block = fragment / BLOCK;
    int place = min(block.y * u_batch.z + block.x, u_batch.y - 1); // past the end: not read
    uint bits = texelFetch(u_pixels, u_batch.x + place).r;
    return ivec2(int(bits & 0xffffu), int(bits >> 16u)) * BLOCK + fragment % BLOCK;
}
