"""The depth that pyrender itself renders, against ours from the camera that `load` makes of pyrender's."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

# pyrender's depth is that of the first of four samples in a pixel, 1/8 of a pixel to the left of its centre and 3/8 below:
# our camera is moved by as much, so that both measure the same points.
BESIDE = """
import json, sys, warnings
import numpy as np
np.infty = np.inf  # the released pyrender wants it
warnings.simplefilter("ignore")
import pyrender, trimesh
import glshadow as gs
from dataclasses import replace

SIZE = (320, 240)
cameras = {
    "intrinsics": pyrender.IntrinsicsCamera(300.0, 310.0, 165.0, 112.5),
    "perspective": pyrender.PerspectiveCamera(yfov=0.8),
    "orthographic": pyrender.OrthographicCamera(xmag=9.0, ymag=2.0),
}
pose = np.linalg.inv(gs.PerspectiveCamera((2, 3, 5), (0, 0.3, 0)).view_from_world)
results = {}
renderer = pyrender.OffscreenRenderer(*SIZE)
theirs, scenes = {}, {}
for name, camera in cameras.items():
    scene = pyrender.Scene()
    for extents, at in (((1, 1, 1), (0, 0.5, 0)), ((6, 0.02, 6), (0, -0.01, 0))):
        box = trimesh.creation.box(extents)
        box.apply_translation(at)
        scene.add(pyrender.Mesh.from_trimesh(box, smooth=False))
    scene.add(camera, pose=pose)
    theirs[name], scenes[name] = renderer.render(scene, flags=pyrender.RenderFlags.DEPTH_ONLY), gs.load(scene)
renderer.delete()
for name, depth in theirs.items():
    camera = scenes[name].camera
    if name == "orthographic":  # it takes every depth buffer for a perspective one
        near, far = cameras[name].znear, cameras[name].zfar
        ndc = (far + near - 2.0 * near * far / np.where(depth > 0.0, depth, near)) / (far - near)
        depth = np.where(depth > 0.0, 0.5 * (far + near + ndc * (far - near)), 0.0)
    if name == "intrinsics":
        moved = replace(camera, cx=camera.cx + 0.125, cy=camera.cy - 0.375)
    else:
        moved = replace(camera, principal=(0.5 + 0.125 / SIZE[0], 0.5 - 0.375 / SIZE[1]))
    with gs.Renderer("egl") as ours:
        frame = ours.render(scenes[name], moved, size=SIZE, outputs=("depth",))
    seen = np.isfinite(frame.depth)
    both = (depth > 0.0) & seen
    off = np.abs(depth - np.where(seen, frame.depth, 0.0))[both] > 1e-3 * depth[both]
    results[name] = [both.mean(), ((depth > 0.0) != seen).mean(), off.mean()]
print(json.dumps(results))
"""


def test_depth_equals_pyrenders() -> None:
    pytest.importorskip("pyrender")
    run = subprocess.run(
        [sys.executable, "-c", BESIDE],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYOPENGL_PLATFORM": "egl"},
    )
    assert run.returncode == 0, run.stderr
    results = json.loads(run.stdout)
    assert set(results) == {"intrinsics", "perspective", "orthographic"}
    for name, (seen, beside, off) in results.items():
        assert seen > 0.3, name
        # edges, where samples are decided after vertices are snapped to 1/256 pixel
        assert beside < 1e-3, name
        assert off < 1e-3, name
