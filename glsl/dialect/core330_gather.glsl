#version 330 core
#extension GL_ARB_texture_gather : require
#extension GL_ARB_gpu_shader5 : require
// The desktop dialect with textureGather on comparison samplers: the extensions, or GLSL 4.00, which includes them.
#define GLS_CORE 1
#define GLS_VARYING in
#define GLS_TEXTURE_2D(map, uv) textureLod(map, uv, 0.0)
