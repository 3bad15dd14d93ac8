// A value in [0, 1) as four bytes, the last one the coarsest, digits to base 255. Inverse of each other.
//   unpack = dot(bytes, 255^(-3, -2, -1, 0)),  bytes in 0..1
// Twin: glshadow.shadows.metric.pack, unpack. Source: the 8-bit path of Babylon.js.

vec4 pack(float value) {
    vec4 digits = fract(value * vec4(16581375.0, 65025.0, 255.0, 1.0)); // 255^3, 255^2, 255, 1
    digits.yzw -= digits.xyz / 255.0; // what the finer digits already hold
    return digits;
}

float unpack(vec4 bytes) {
    return dot(bytes, vec4(6.0308629e-8, 1.5378700e-5, 3.9215686e-3, 1.0));
}
