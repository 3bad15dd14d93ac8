"""Many images from a file of jobs. Look at: the images of a day, drawn by two processes; a second run draws none again."""

import json
from pathlib import Path

import numpy as np

import glshadow as gs
from glshadow import image

HOURS = range(8, 17)
jobs = Path("22_jobs.jsonl")
with jobs.open("w") as file:
    for hour in HOURS:
        angle = np.radians(15.0 * (hour - 12))
        sun = {"kind": "sun", "direction": [-float(np.sin(angle)), -float(np.cos(angle)) - 0.1, -0.6], "intensity": 0.8}
        job = {"scene": "courtyard", "output": f"{hour:02d}.png", "size": [320, 180], "lights": [sun]}
        file.write(json.dumps(job) + "\n")

if __name__ == "__main__":  # processes are started, which read this file again
    done = gs.batch.run_batch(gs.batch.read_jobs(jobs), "22_many_pictures", processes=2)
    print(done)
    pictures = [image.read(Path("22_many_pictures") / f"{hour:02d}.png")[..., :3] for hour in HOURS]
    sheet = np.vstack([np.hstack(pictures[k : k + 3]) for k in (0, 3, 6)])
    image.write("22_many_pictures.png", sheet)
