// Slot <shadow> for a light whose visibility earlier passes found: that of the pixel, or of the points of a collected one.
#ifndef GLS_COLUMNS
#define GLS_COLUMNS 4
#endif
#ifndef GLS_ROWS
#define GLS_ROWS 4
#endif
uniform sampler2D u_given; // visibility, or -1 - (2 number + visibility)
uniform sampler2D u_points; // a block for each number

float light_visibility(vec3 position_lv, vec3 normal_lv, float cosine) {
    float given = texelFetch(u_given, ivec2(gl_FragCoord.xy), 0).r;
    int place = int(-1.0 - given) / 2, width = textureSize(u_given, 0).x;
    ivec2 block = ivec2(place % width, place / width) * ivec2(GLS_COLUMNS, GLS_ROWS);
    int count = given < 0.0 ? GLS_COLUMNS * GLS_ROWS : 0;
    float sum = 0.0;
    for (int i = 0; i < count; i++) {
        sum += texelFetch(u_points, block + ivec2(i % GLS_COLUMNS, i / GLS_COLUMNS), 0).r;
    }
    return given < 0.0 ? sum / float(GLS_COLUMNS * GLS_ROWS) : given;
}
