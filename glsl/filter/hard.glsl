// A single comparison with the nearest texel. Williams 1978, "Casting Curved Shadows on Curved Surfaces".
float visibility(Receiver receiver) {
    return compare_one(receiver.texel, compare_depth(receiver, vec2(0.0)));
}
