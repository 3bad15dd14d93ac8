// The samples of collected pixels lie densely: a block of them for each pixel, block after block in rows. Needs core330.
#ifndef GLS_COLUMNS
#define GLS_COLUMNS 2 // of a block: samples of one pixel
#endif
#ifndef GLS_ROWS
#define GLS_ROWS 2
#endif
uniform usamplerBuffer u_pixels; // the collected: x, y << 16
uniform ivec3 u_batch; // the first of those that are drawn, how many, blocks in a row
const ivec2 BLOCK = ivec2(GLS_COLUMNS, GLS_ROWS);

ivec2 sample_texel(ivec2 fragment) { // of the buffer that has every sample of the image
    ivec2 block = fragment / BLOCK;
    int place = min(block.y * u_batch.z + block.x, u_batch.y - 1); // beyond the last: nobody looks
    uint bits = texelFetch(u_pixels, u_batch.x + place).r;
    return ivec2(int(bits & 0xffffu), int(bits >> 16u)) * BLOCK + fragment % BLOCK;
}
