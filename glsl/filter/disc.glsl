// The mean of bilinear comparisons on a spiral that fills a disc evenly: tap i of n at sqrt((i + 1/2) / n), turned by i golden angles.
// The plane is followed to each tap's 2 x 2 texels. GLS_DISC_ROTATE: turned from pixel to pixel by interleaved gradient noise.
// Vogel 1979; Castano 2013; Jimenez 2014. Twin: glshadow.core.filters.disc
#ifndef GLS_DISC_RADIUS
#define GLS_DISC_RADIUS 2.0
#endif
#ifndef GLS_DISC_TAPS
#define GLS_DISC_TAPS 16
#endif
#ifndef GLS_DISC_ROTATE
#define GLS_DISC_ROTATE 0
#endif

float visibility(Receiver receiver) {
#if GLS_DISC_ROTATE
    float turn = 6.2831853 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
    vec2 axis = vec2(cos(turn), sin(turn));
#endif
    float sum = 0.0;
    for (int i = 0; i < GLS_DISC_TAPS; i++) {
        float angle = float(i) * 2.3999632;
        vec2 offset = vec2(cos(angle), sin(angle)) * (GLS_DISC_RADIUS * sqrt((float(i) + 0.5) / float(GLS_DISC_TAPS)));
#if GLS_DISC_ROTATE
        offset = vec2(axis.x * offset.x - axis.y * offset.y, axis.y * offset.x + axis.x * offset.y);
#endif
        vec2 place = receiver.texel + offset - 0.5;
        vec2 base = floor(place);
        vec2 f = place - base;
        vec4 lit = compare_four(base + 1.0, compare_depth(receiver, base + 1.0 - receiver.texel));
        vec2 lower = vec2(lit.w, lit.z), upper = vec2(lit.x, lit.y);
        vec2 row = lower + f.y * (upper - lower);
        sum += row.x + f.x * (row.y - row.x);
    }
    return min(sum / float(GLS_DISC_TAPS), 1.0); // a lit plateau may round above 1
}
