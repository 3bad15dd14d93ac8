"""The same shadow in every depth convention. Look at: the printed differences; only the format's own step shows."""

import numpy as np
from numpy.typing import NDArray

import glshadow as gs

scene = gs.scenes.courtyard()
with gs.Renderer() as renderer:

    def visibility(clip: gs.ClipSpace | None = None, target: gs.Target | None = None) -> NDArray[np.float32]:
        sun = gs.DirectionalLight(shadow=gs.Shadow(filter=gs.Hard(), clip=clip, target=target))
        return renderer.render(scene, lights=[sun], outputs=("visibility",)).visibility

    reference = visibility()
    for zero_to_one in (False, True):
        for reversed_depth in (False, True):
            clip = gs.ClipSpace(zero_to_one, reversed_depth)
            for target in (gs.Target.DEPTH16, gs.Target.DEPTH32F, gs.Target.R32F, gs.Target.RGBA8):
                changed = np.nansum(visibility(clip=clip, target=target) != reference) - np.isnan(reference).sum()
                print(f"clip {clip!s:14s} {target.value:9s} {changed:5d} pixels differ")
