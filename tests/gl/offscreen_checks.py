"""pyrender's OffscreenRenderer and ours on the same pyrender scenes, in a process of its own; prints what test_offscreen.py checks."""

import json
import sys
import warnings
from typing import Any

import numpy as np

np.inf = np.inf  # type: ignore[attr-defined]  # the released pyrender needs it
warnings.simplefilter("ignore")
import pyrender  # noqa: E402
import trimesh  # noqa: E402

import glshadow as gs  # noqa: E402

SIZE = (320, 240)
Flags = pyrender.RenderFlags
OWN = {"sun": Flags.SHADOWS_DIRECTIONAL, "spot": Flags.SHADOWS_SPOT, "point": Flags.SHADOWS_POINT}


def built(kind: str) -> tuple[Any, list[Any]]:
    """Two boxes and a ground of plain dielectrics, as pyrender objects."""
    scene = pyrender.Scene(bg_color=[0.2, 0.4, 0.6, 0.5], ambient_light=[0.1, 0.1, 0.1])
    nodes = []
    for extents, at, color in (
        ((1, 1, 1), (0, 0.5, 0), (0.9, 0.2, 0.2)),
        ((0.5, 2, 0.5), (1.2, 1.0, -0.5), (0.2, 0.8, 0.3)),
        ((6, 0.02, 6), (0, -0.01, 0), (0.8, 0.8, 0.8)),
    ):
        box = trimesh.creation.box(extents)
        material = pyrender.MetallicRoughnessMaterial(
            baseColorFactor=(*color, 1.0), metallicFactor=0.0, roughnessFactor=1.0
        )
        pose = np.eye(4)
        pose[:3, 3] = at
        nodes.append(scene.add(pyrender.Mesh.from_trimesh(box, material=material, smooth=False), pose=pose))
    scene.add(pyrender.PerspectiveCamera(yfov=0.8), pose=looking((3, 3, 5), (0, 0.3, 0)))
    pose = looking((-3.0, 3.5, 1.5), (0, 0, 0))
    light = {
        "sun": pyrender.DirectionalLight(intensity=3.0),
        "spot": pyrender.SpotLight(intensity=120.0, innerConeAngle=0.5, outerConeAngle=0.7),
        "point": pyrender.PointLight(intensity=120.0),
    }[kind]
    scene.add(light, pose=pose)
    return scene, nodes


def looking(eye: tuple[float, ...], target: tuple[float, ...]) -> Any:
    return np.linalg.inv(gs.PerspectiveCamera(eye, target).view_from_world)  # type: ignore[arg-type]


def main() -> None:
    found: dict[str, Any] = {}
    theirs, ours = pyrender.OffscreenRenderer(*SIZE), gs.PyrenderRenderer(*SIZE)
    for kind in ("sun", "spot", "point"):
        scene, nodes = built(kind)
        a, depth_a = theirs.render(scene)
        b, depth_b = ours.render(scene)
        gap = np.abs(a.astype(int) - b).max(axis=-1)
        both = (depth_a > 0) & (depth_b > 0)
        shadowed, _ = ours.render(scene, Flags.SHADOWS_ALL)
        colors = {nodes[0]: (255, 0, 0), nodes[2]: (0, 0, 255)}
        seg_a, _ = theirs.render(scene, Flags.SEG, colors)
        seg_b, _ = ours.render(scene, Flags.SEG, colors)
        rgba_a, _ = theirs.render(scene, Flags.RGBA)
        rgba_b, _ = ours.render(scene, Flags.RGBA)
        only = ours.render(scene, Flags.DEPTH_ONLY)
        found[kind] = {
            "shapes": [list(each.shape) for each in (b, depth_b, shadowed, seg_b, rgba_b, only)],
            "types": [str(each.dtype) for each in (b, depth_b, rgba_b, only)],
            "median": float(np.median(gap)),
            "far": float((gap > 12).mean()),
            "depth": float(np.median(np.abs(depth_a - depth_b)[both])),
            "nearer": float(np.median(depth_b[both] / depth_a[both])),
            "own": float(((b != ours.render(scene, OWN[kind])[0]).any(axis=-1)).mean()),
            "others": float(((b != ours.render(scene, Flags.SHADOWS_ALL & ~OWN[kind])[0]).any(axis=-1)).mean()),
            "covered": float(((depth_a > 0) != (depth_b > 0)).mean()),
            "darker": float((b.astype(int).sum(axis=-1) - shadowed.astype(int).sum(axis=-1) > 30).mean()),
            "brighter": int((b.astype(int).sum(axis=-1) - shadowed.astype(int).sum(axis=-1)).min()),
            "seg": float((np.abs(seg_a.astype(int) - seg_b).max(axis=-1) > 0).mean()),
            "alpha": float(np.median(np.abs(rgba_a[..., 3].astype(int) - rgba_b[..., 3]))),
            "background": [rgba_a[0, 0].tolist(), rgba_b[0, 0].tolist()],
        }
    theirs.delete()
    with gs.PyrenderRenderer(*SIZE) as again:
        scene, nodes = built("sun")
        first, _ = again.render(scene, Flags.SHADOWS_ALL)
        scene.set_pose(nodes[0], looking((0.8, 1.0, 0.5), (0.0, 0.0, 0.0)))
        moved, _ = again.render(scene, Flags.SHADOWS_ALL)
        kept = [id(node.mesh) for node in again._last[1].nodes]  # type: ignore[index]
        scene.set_pose(nodes[0], np.eye(4))
        again.render(scene)
        found["kept"] = kept == [id(node.mesh) for node in again._last[1].nodes]  # type: ignore[index]
        found["moved"] = bool((first != moved).any())
        again.viewport_width = 100
        found["resized"] = list(again.render(scene)[0].shape)
        empty = pyrender.Scene()
        empty.add(pyrender.PerspectiveCamera(yfov=0.8))
        found["empty"] = [list(each.shape) for each in again.render(empty)]
    soft = gs.PyrenderRenderer(*SIZE, angle=8.0)
    scene, _ = built("sun")
    found["greys"] = [len(np.unique(each.render(scene, Flags.SHADOWS_ALL)[0][..., 0])) for each in (ours, soft)]
    for each in (ours, soft):
        each.delete()
    json.dump(found, sys.stdout)


main()
