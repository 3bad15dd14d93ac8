// Per pixel the lights that request per-sample shading: one bit each, 31 in a word, the words stacked in one texture. The highest bit of a
// word means that a light of an earlier word requests it.
const int LIGHTS_PER_WORD = 31;

ivec2 request_at(ivec2 pixel, int light, int height) {
    return pixel + ivec2(0, height * (light / LIGHTS_PER_WORD));
}

uint request_bit(int light) {
    return 1u << uint(light % LIGHTS_PER_WORD);
}
