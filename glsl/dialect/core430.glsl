#version 430 core
// The dialect of compute passes, and of fragment passes that write lists: storage buffers, image atomics, precise.
#define GLS_CORE 1
#define GLS_PRECISE precise
#define GLS_VARYING in
