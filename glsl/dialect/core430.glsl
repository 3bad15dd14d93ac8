#version 430 core
// The dialect of compute passes, and of fragment passes that write lists: storage buffers, image atomics, precise.
#define GLS_CORE 1
#define GLS_PRECISE precise
#define GLS_VARYING in
#define GLS_TEXTURE_2D(map, uv) textureLod(map, uv, 0.0)
