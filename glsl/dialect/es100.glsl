#version 100
// The WebGL 1 dialect: GLSL ES 1.00. Colour targets only, no comparison samplers, hardly any integers.
#ifndef GLS_DERIVATIVES
#define GLS_DERIVATIVES 0 // 1: dFdx and dFdy, by an extension that WebGL 1 must enable first
#endif
#if GLS_DERIVATIVES
#extension GL_OES_standard_derivatives : enable
#endif
#define GLS_CORE 0
#ifdef GLS_VERTEX
#define GLS_ATTRIBUTE attribute
#else
precision highp float; // a metric in mediump (10 bits) would cause self-shadowing
precision highp int;
#endif
#define GLS_VARYING varying
#define GLS_TEXTURE_2D(map, uv) texture2D(map, uv)
