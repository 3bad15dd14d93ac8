#version 330 core
// The desktop dialect: GLSL 3.30 core. The only files where dialects differ are in this folder.
#define GLS_CORE 1
#define GLS_PRECISE // available from GLSL 4.00
#ifdef GLS_VERTEX
#define GLS_ATTRIBUTE in
#define GLS_VARYING out
#else
#define GLS_VARYING in
#endif
#define GLS_TEXTURE_2D(map, uv) textureLod(map, uv, 0.0)
