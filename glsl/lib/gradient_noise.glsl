// Interleaved gradient noise, 0 to 1: neighbouring pixels get values far apart (Jimenez 2014).
float gradient_noise(vec2 pixel) {
    return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}
