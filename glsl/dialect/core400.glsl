#version 400 core
// The desktop dialect with textureGather and precise, for exact filters.
#define GLS_CORE 1
#define GLS_PRECISE precise
#define GLS_VARYING in
#define GLS_TEXTURE_2D(map, uv) textureLod(map, uv, 0.0)
