// Babylon's caster-side bias: clip z += s * bias * w * factor (0.5 for NDC 0..1), vertex -= N * amount * sin(angle to the light).
// Mesh space in, mesh space out; u_light is the light's position (w = 1) or the way to it (w = 0) there.
// Twins: glshadow.shadows.bias.normal_bias, bias_factor. Source: Babylon.js shadowMapVertexNormalBias, shadowMapVertexMetric
GLS_ATTRIBUTE vec3 a_normal;
uniform float u_clip_bias; // s * bias * factor
uniform float u_normal_bias; // mesh units
uniform vec4 u_light;

vec3 normal_biased(vec3 position) {
    vec3 towards = normalize(u_light.xyz - position * u_light.w);
    float cosine = dot(a_normal, towards);
    return position - a_normal * (u_normal_bias * sqrt(max(0.0, 1.0 - cosine * cosine)));
}

float clip_biased(vec4 position_lc) {
    return position_lc.z + u_clip_bias * position_lc.w;
}
