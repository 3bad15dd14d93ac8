// Depth metric of point lights: (distance + near) / (near + far). position_lv: relative to the light.
// Source: Babylon.js, "Mathematics of the depth metric". Twin: glshadow.shadows.metric.radial_metric
uniform vec3 u_metric; // 1 / (near + far), near / (near + far), bias in metric units

float depth_metric(vec4 position_lc, vec3 position_lv) {
    return clamp(length(position_lv) * u_metric.x + u_metric.y + u_metric.z, 0.0, 1.0);
}
