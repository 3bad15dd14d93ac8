"""Identity of a measurement: a hash of the scene, and a hash of all its inputs."""

from __future__ import annotations

import hashlib

import numpy as np

from glshadow import __version__
from glshadow.core.cameras import Camera
from glshadow.journal import digest_of
from glshadow.lights import Light
from glshadow.scene.nodes import Scene
from glshadow.shadows.shadow import Shadow


def fingerprint(scene: Scene) -> str:
    """Hash of everything that affects the scene's shadows: triangles, transforms, and alpha where it is tested."""
    digest = hashlib.sha256()
    done: dict[int, bytes] = {}
    for node in scene.nodes:
        mesh = node.mesh
        if id(mesh) not in done:
            material = mesh.material
            parts = (mesh.positions, mesh.triangles, mesh.normals, mesh.uv, mesh.colors, material.texture)
            one = hashlib.sha256(repr((material.color, material.alpha_mode.value, material.cutoff)).encode())
            one.update(repr(material.double_sided).encode())
            for part in parts:
                one.update(b"-" if part is None else repr(part.shape).encode() + np.ascontiguousarray(part).tobytes())
            done[id(mesh)] = one.digest()
        digest.update(done[id(mesh)] + node.world_from_mesh.tobytes())
    return digest.hexdigest()


def result_key(
    scene: str,
    camera: Camera,
    light: Light,
    size: tuple[int, int],
    shadow: Shadow,
    machine: str,
    repeats: int,
) -> str:
    """Hash of a result's inputs: scene (its fingerprint), image, settings, machine and version."""
    return digest_of(scene, camera, light, tuple(size), shadow, machine, repeats, __version__)
