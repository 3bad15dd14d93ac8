// Clears the surface buffer to background.
#ifndef GLS_SURFACE
#define GLS_SURFACE 1
#endif
#if GLS_SURFACE == 1
layout(location = 0) out uint o_surface;
#elif GLS_SURFACE == 2
layout(location = 0) out uvec2 o_surface;
#else
layout(location = 0) out uvec4 o_surface;
#endif

void main() {
#if GLS_SURFACE == 1
    o_surface = 0u;
#elif GLS_SURFACE == 2
    o_surface = uvec2(0u);
#else
    o_surface = uvec4(0u);
#endif
}
