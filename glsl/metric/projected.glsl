// Depth metric of directional and spot lights: (s z + min_z) / (min_z + max_z), s = -1 if reversed, z = clip z before division.
// position_lc: light clip. Result 0 at near, 1 at far and beyond, in every clip convention.
// Source: Babylon.js, "Mathematics of the depth metric". Twin: glshadow.shadows.metric.projected_metric
uniform vec3 u_metric; // s / (min_z + max_z), min_z / (min_z + max_z), bias in metric units

float depth_metric(vec4 position_lc, vec3 position_lv) {
    return clamp(position_lc.z * u_metric.x + u_metric.y + u_metric.z, 0.0, 1.0);
}
