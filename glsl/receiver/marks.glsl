// Whether the samples of a pixel may see a shadow map differently. Where pixels are larger than texels, the map is sampled at several
// points of the pixel's footprint; elsewhere a shadow is no thinner than a pixel, and neighbours reveal it. Needs <projection> and
// lib/pixel_footprint.glsl.
const float DIFFERENT = 0.3; // of visibility, as in pass/collect.frag

bool samples_differ(PixelFootprint f, float cosine, float lit) {
    vec2 texel = project_receiver(f.middle, f.normal).texel; // of the cascade sampled last
    vec2 right = project_receiver(f.middle + f.right, f.normal).texel - texel;
    vec2 up = project_receiver(f.middle + f.up, f.normal).texel - texel;
    vec2 half_span = abs(right) + abs(up), count = round(0.5 / (0.5 - u_sampled.xy));
    float pixel = max(half_span.x, half_span.y) / min(u_sampled.x, u_sampled.y); // size of the pixel in texels
    int columns = int(count.x), turns = cosine > 0.0 && (f.open || pixel > 1.0) ? columns * int(count.y) : 0;
    bool differ = false;
    for (int i = 0; i < turns; i++) {
        vec2 at = 2.0 * vec2(i % columns, i / columns) / max(count - 1.0, 1.0) - 1.0;
        float there = light_visibility(f.middle + at.x * f.right + at.y * f.up, f.normal, cosine);
        differ = abs(there - lit) > DIFFERENT;
        turns = differ ? 0 : turns;
    }
    return differ;
}
