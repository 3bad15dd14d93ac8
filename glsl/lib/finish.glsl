// From the sum of all lights to the sample's premultiplied linear colour and alpha.
#ifndef GLS_CATCHES
#define GLS_CATCHES 0 // 1: some surfaces are shadow catchers; their sum is (light, light without shadow, 0)
#endif
const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722); // ITU-R BT.709

vec4 finished(vec3 sum, bool catcher) {
#if GLS_CATCHES
    float kept = sum.g > 0.0 ? min(sum.r / sum.g, 1.0) : 1.0;
    if (catcher) return vec4(0.0, 0.0, 0.0, 1.0 - kept);
#endif
    return vec4(sum, 1.0);
}
