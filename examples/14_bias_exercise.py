"""p5.tree's first exercise: the smallest depth bias without acne, by bisection. Look at: the numbers, which differ between landscapes.

The error is measured against rays. What one landscape needs is too little for the next, or too much; the derived bias has nothing to find.
"""

import glshadow as gs

SIZE = (320, 240)
NO_ACNE = 1e-4  # of the pixels that face the light

with gs.Renderer() as renderer:

    def scored(scene: gs.Scene, truth: gs.Truth, bias: gs.Bias) -> gs.Score:
        shadow = gs.Shadow(filter=gs.Hard(), resolution=512, fit=gs.SceneFit(), bias=bias)
        light = gs.scenes.landscape_light(shadow=shadow)
        return gs.measure(renderer.render(scene, lights=[light], size=SIZE, outputs=("visibility",)), truth)

    for number in (1, 2, 3):
        scene = gs.scenes.landscape(number)
        truth = gs.trace(scene, size=SIZE)
        low, high = 0.0, 0.05  # window depth, as the sketch subtracts it; a ClipBias of 1 is half of it
        for _ in range(11):
            middle = 0.5 * (low + high)
            clean = scored(scene, truth, gs.ClipBias(2.0 * middle, caster=False)).acne <= NO_ACNE
            low, high = (low, middle) if clean else (middle, high)
        print(f"landscape {number}: the smallest bias without acne is {high:.5f} of the depth range")
        for name, bias in (("that", gs.ClipBias(2.0 * high, caster=False)), ("derived", gs.ReceiverPlaneBias())):
            found = scored(scene, truth, bias)
            print(f"  {name}: acne {found.acne:.3%}, wrong {found.wrong:.3%}, leak {found.leak:.3%}")
