#version 100
// The WebGL 1 dialect: GLSL ES 1.00. Colour targets only, no comparison sampler, no integers to speak of.
#define GLS_CORE 0
#ifdef GLS_VERTEX
#define GLS_ATTRIBUTE attribute
#else
precision highp float;
precision highp int;
#endif
#define GLS_VARYING varying
#define GLS_TEXTURE_2D(map, uv) texture2D(map, uv)
