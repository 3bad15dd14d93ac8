"""A shadowed image in three lines. Look at: the fence's shadow on the ground, sharp slats down to the rail; no stripes anywhere."""

import glshadow as gs

frame = gs.render(gs.scenes.courtyard(), path="01_first_picture.png")
print(frame.image.shape, "lit:", f"{(frame.visibility[0] > 0.5).mean():.0%} of the image")
