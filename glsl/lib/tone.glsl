// Exposure and tone map of linear light, before sRGB. Float64 twin: glshadow/core/tone.py
// Source: the specification of Khronos PBR Neutral (KhronosGroup/ToneMapping, PBR_Neutral/README.md) with its F_90 = 0: ambient light is
// not reflected here, so that nothing has to be subtracted for it.
#ifndef GLS_TONE
#define GLS_TONE 0 // 1: Khronos PBR Neutral; 0: none
#endif
#ifndef GLS_EXPOSED
#define GLS_EXPOSED 0 // 1: light is scaled by u_exposure
#endif
#if GLS_EXPOSED
uniform float u_exposure;
#endif
const float TONE_START = 0.8;
const float TONE_DESATURATION = 0.15;

float tone_peak(vec3 color) {
    return max(color.r, max(color.g, color.b));
}

vec3 exposed(vec3 linear) {
#if GLS_EXPOSED
    return linear * u_exposure;
#else
    return linear;
#endif
}

vec3 toned(vec3 color) {
#if GLS_TONE
    float peak = tone_peak(color);
    float over = max(peak, TONE_START);
    float top = 1.0 - (1.0 - TONE_START) * (1.0 - TONE_START) / (over + 1.0 - 2.0 * TONE_START);
    float grey = 1.0 - 1.0 / (TONE_DESATURATION * (over - top) + 1.0);
    return peak <= TONE_START ? color : mix(color * (top / over), vec3(top), grey);
#else
    return color;
#endif
}
