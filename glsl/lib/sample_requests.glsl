// Which lights ask for the samples of a pixel: a bit for each, 31 in a word, word over word in one texture. The highest bit of a word says
// that some light of the words before asks.
const int LIGHTS_PER_WORD = 31;

ivec2 request_at(ivec2 pixel, int light, int height) {
    return pixel + ivec2(0, height * (light / LIGHTS_PER_WORD));
}

uint request_bit(int light) {
    return 1u << uint(light % LIGHTS_PER_WORD);
}
