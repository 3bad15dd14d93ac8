// The blocks of samples of pixels in the buffers of blended layers, and whether a layer covers any sample of a pixel. Needs core330.
#ifndef GLS_COLUMNS
#define GLS_COLUMNS 2 // samples of a pixel
#endif
#ifndef GLS_ROWS
#define GLS_ROWS 2
#endif
uniform sampler2D u_through; // per sample what all layers let through; 1 where there is none
uniform sampler2D u_added; // their own light
const int SAMPLES = GLS_COLUMNS * GLS_ROWS;

ivec2 sample_of(ivec2 pixel, int number) {
    return pixel * ivec2(GLS_COLUMNS, GLS_ROWS) + ivec2(number % GLS_COLUMNS, number / GLS_COLUMNS);
}

ivec2 pixel_of(ivec2 place) { // of a sample
    return place / ivec2(GLS_COLUMNS, GLS_ROWS);
}

bool is_layered(ivec2 pixel) {
    bool layered = false;
    for (int i = 0; i < SAMPLES; i++) {
        ivec2 place = sample_of(pixel, i);
        layered = layered || any(notEqual(texelFetch(u_through, place, 0).rgb, vec3(1.0)))
            || any(notEqual(texelFetch(u_added, place, 0).rgb, vec3(0.0)));
    }
    return layered;
}
