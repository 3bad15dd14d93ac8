"""Scenes, cameras, lights and shadows at random: all valid, many extreme."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

import glshadow as gs
from glshadow.scenes import shapes

Rng = np.random.Generator


@dataclass(frozen=True)
class Case:
    """One frame to render; `text` describes its settings."""

    scene: gs.Scene
    camera: gs.Camera | None
    lights: tuple[Any, ...] | None
    size: tuple[int, int]
    ambient: float
    background: tuple[float, float, float]

    @property
    def text(self) -> str:
        """All that is needed to reproduce the case, except for the scene's triangles."""
        low, high = self.scene.bounds.tolist()
        rows = [f"scene {self.scene.name}, bounds {low} {high}", f"camera {self.camera}", f"size {self.size}",
                f"ambient {self.ambient}, background {self.background}"]  # fmt: skip
        return "\n".join([*rows, *(f"light {light}" for light in self.lights or ())])


def case(rng: Rng) -> Case:
    """A case whose parts are all valid settings."""
    while True:
        scene = _scene(rng)
        try:
            camera = _camera(rng, scene) if rng.random() < 0.8 else None
            lights = tuple(_light(rng, scene) for _ in range(rng.integers(0, 4))) if rng.random() < 0.95 else None
        except gs.SettingsError:  # near >= far, eye = target, ...: refused by the constructor, which is not tested here
            continue
        size = (int(rng.integers(1, 81)), int(rng.integers(1, 81)))
        background = tuple(float(x) for x in rng.random(3))
        ambient = float(rng.choice([0.0, 0.1, 1.0])) if rng.random() < 0.95 else float(10.0 ** rng.uniform(-50, 38))
        return Case(scene, camera, lights, size, ambient, background)  # type: ignore[arg-type]


def _scene(rng: Rng) -> gs.Scene:
    """A few solids in a metre, everything scaled by up to 1e12 either way, sometimes far from the origin."""
    floor = shapes.rectangle((-1, 0, 1), (2, 0, 0), (0, 0, -2))
    kinds: dict[str, list[shapes.Solid]] = {
        "box on a floor": [floor, shapes.box((0.5, 0.5, 0.5), (0, 0.25, 0))],
        "ball over a floor": [floor, _ball()],
        "room": [(positions, triangles[:, ::-1].copy()) for positions, triangles in [shapes.box((2, 1, 2))]]
        + [shapes.box((0.1, 0.6, 0.1))],
        "floor": [floor],
        "triangle": [(floor[0][:3], floor[1][:1])],
        "needle": [shapes.box((1.0, 1e-5, 1e-5))],
        "sheets": [shapes.rectangle((-1, y, 1), (2, 0, 0), (0, 0, -2)) for y in (0.0, 1e-6, 0.3)],
        "two of one": [floor, floor],
    }
    name = str(rng.choice(list(kinds)))
    scale = float(10.0 ** (rng.uniform(-12, 12) if rng.random() < 0.6 else rng.uniform(-2, 2)))
    offset = scale * rng.normal(size=3) * float(rng.choice([0.0, 0.0, 1.0, 1e3, 1e6]))
    baked = rng.random() < 0.5
    nodes = []
    for number, (positions, triangles) in enumerate(kinds[name]):
        matrix = np.eye(4)
        if baked:
            positions = positions * scale
        else:
            matrix[:3, :3] *= scale
        if rng.random() < 0.15:
            matrix[:3, :3] = matrix[:3, :3] @ np.diag(rng.choice([-1.0, 1.0, 1e-3, 0.0], size=3))
        matrix[:3, 3] = offset
        nodes.append(gs.Node(gs.Mesh(positions, triangles, material=_material(rng)), matrix, f"{number}"))
    try:
        return gs.Scene(tuple(nodes), name=f"{name} x {scale:g} at {offset.tolist()}")
    except gs.SceneError:  # the only solid was flattened to a point
        return _scene(rng)


def _ball() -> shapes.Solid:
    positions, triangles = shapes.icosphere(2, 0.3)
    return positions + np.array([0.1, 0.5, 0.0]), triangles


def _material(rng: Rng) -> gs.Material:
    return gs.Material(
        color=(*(float(x) for x in rng.random(3)), 1.0),  # type: ignore[arg-type]
        alpha_mode=gs.AlphaMode(str(rng.choice(["OPAQUE", "OPAQUE", "OPAQUE", "MASK", "BLEND"]))),
        double_sided=bool(rng.random() < 0.3),
    )


def _point(rng: Rng, scene: gs.Scene) -> tuple[float, float, float]:
    """A vertex, a point on a surface, the centre, one nearby, or one far away."""
    low, high = scene.bounds
    size = float(np.linalg.norm(high - low))
    node = scene.nodes[int(rng.integers(len(scene.nodes)))]
    corners = node.mesh.positions[node.mesh.triangles[int(rng.integers(len(node.mesh.triangles)))]]
    corners = corners @ node.world_from_mesh[:3, :3].T + node.world_from_mesh[:3, 3]
    way = rng.random()
    if way < 0.1:
        point = corners[0]
    elif way < 0.25:
        point = rng.dirichlet(np.ones(3)) @ corners
    elif way < 0.35:
        point = 0.5 * (low + high)
    else:
        reach = 10.0 ** (rng.uniform(-1, 1) if way < 0.85 else rng.uniform(-9, 9))
        point = 0.5 * (low + high) + size * reach * rng.normal(size=3)
    return (float(point[0]), float(point[1]), float(point[2]))


def _direction(rng: Rng) -> tuple[float, float, float]:
    axes = [
        (0.0, -1.0, 0.0),
        (0.0, 1.0, 0.0),
        (1.0, 0.0, 0.0),
        (1e-7, -1.0, 0.0),
        (1.0, -1e-4, 0.0),
        (0.0, -1e-200, 0.0),
    ]
    if rng.random() < 0.3:
        return axes[int(rng.integers(len(axes)))]
    x, y, z = rng.normal(size=3).tolist()
    return (x, y, z)


def _size(scene: gs.Scene) -> float:
    return float(np.linalg.norm(scene.bounds[1] - scene.bounds[0]))


def _plane(rng: Rng, scene: gs.Scene) -> float | None:
    if rng.random() < 0.8:
        return None
    return _size(scene) * float(10.0 ** (rng.uniform(-2, 2) if rng.random() < 0.7 else rng.uniform(-8, 8)))


def _camera(rng: Rng, scene: gs.Scene) -> gs.Camera:
    target = scene.bounds.mean(axis=0).tolist() if rng.random() < 0.7 else _point(rng, scene)
    fov = float(rng.choice([1e-3, 1.0, 179.0, 179.9])) if rng.random() < 0.2 else float(rng.uniform(10, 120))
    camera = gs.PerspectiveCamera(
        _point(rng, scene), tuple(target), _direction(rng), fov, _plane(rng, scene), _plane(rng, scene),
        principal=(0.5, 0.5) if rng.random() < 0.9 else (float(rng.uniform(-2, 3)), float(rng.uniform(-2, 3))),
        pixel_aspect=1.0 if rng.random() < 0.9 else float(10.0 ** rng.uniform(-2, 2)),
    )  # fmt: skip
    kind = rng.random()
    if kind < 0.2:
        reach = rng.uniform(-1, 1) if rng.random() < 0.7 else rng.uniform(-8, 8)
        return camera.through(gs.OrthographicCamera, height=_size(scene) * float(10.0**reach))
    if kind < 0.3:
        fx, fy, cx, cy = (*(10.0 ** rng.uniform(-1, 5, 2)), *rng.uniform(-50, 130, 2))
        return camera.through(gs.IntrinsicsCamera, fx=float(fx), fy=float(fy), cx=float(cx), cy=float(cy))
    return camera


def _light(rng: Rng, scene: gs.Scene) -> gs.DirectionalLight | gs.SpotLight | gs.PointLight:
    settings: dict[str, Any] = {
        "color": tuple(float(x) for x in rng.random(3)),
        "intensity": _amount(rng),
        "shadow": _shadow(rng, scene) if rng.random() < 0.9 else None,
        "near": _plane(rng, scene),
        "far": _plane(rng, scene),
    }
    kind = rng.integers(3)
    if kind == 0:
        return gs.DirectionalLight(
            direction=_direction(rng), angle=float(rng.choice([0.0, 0.0, 0.5, 89.9])), **settings
        )
    settings["position"] = _point(rng, scene)
    settings["radius"] = float(rng.choice([0.0, 0.0, 0.1])) * _size(scene)
    settings["range"] = None if rng.random() < 0.7 else _size(scene) * float(10.0 ** rng.uniform(-3, 3))
    settings["falloff"] = float(rng.choice([0.0, 1.0, 2.0, 8.0]))
    if kind == 1:
        return gs.PointLight(**settings)
    outer = float(rng.choice([0.01, 0.1, 45.0, 89.0, 89.9, 89.99])) if rng.random() < 0.4 else float(rng.uniform(1, 85))
    inner = outer * float(rng.choice([0.0, 0.5, 1.0]))
    return gs.SpotLight(direction=_direction(rng), inner_angle=inner, outer_angle=outer, **settings)


def _amount(rng: Rng) -> float:
    """A strength: common, zero, or any valid value."""
    if rng.random() < 0.5:
        return float(rng.choice([0.0, 1.0]))
    return float(10.0 ** (rng.uniform(-3, 3) if rng.random() < 0.9 else rng.uniform(-300, 38)))


def _shadow(rng: Rng, scene: gs.Scene) -> gs.Shadow:
    size, target = _size(scene), None if rng.random() < 0.3 else list(gs.Target)[int(rng.integers(len(gs.Target)))]
    factor = float(10.0 ** rng.uniform(-6, 2))
    biases: list[Any] = [None, None, gs.NoBias(), gs.ConstantBias(size * factor), gs.NormalOffsetBias(factor), gs.ReceiverPlaneBias(),
                         gs.ClipBias(factor * float(rng.choice([-1, 1])), size * factor, bool(rng.random() < 0.5))]  # fmt: skip
    if target is None or target.is_depth:
        biases.append(gs.SlopeScaledBias(factor, factor))
    faces = [None, None, *gs.Faces]
    exact = rng.random() < 0.3
    kind = gs.Hard() if rng.random() < 0.3 else gs.Pcf(int(rng.integers(0, 5)))
    return gs.Shadow(
        resolution=int(rng.integers(1, 8)) if rng.random() < 0.2 else int(rng.integers(1, 301)),
        filter=gs.Exact(int(rng.choice([1, 1, 4, 8, 16]))) if exact else kind,
        bias=None if exact else biases[int(rng.integers(len(biases)))],
        target=None if exact else target,
        clip=None if rng.random() < 0.5 else gs.ClipSpace(bool(rng.random() < 0.5), bool(rng.random() < 0.5)),
        fit=gs.ViewFit() if rng.random() < 0.6 else gs.SceneFit(),
        faces=faces[int(rng.integers(len(faces)))],
        strength=float(rng.choice([0.0, 0.5, 1.0])),
    )
