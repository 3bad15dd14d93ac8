#version 430 core
// The dialect of compute passes: storage buffers, image atomics, precise.
#define GLS_CORE 1
#define GLS_PRECISE precise
