"""Results as they come, one JSON line each: what an interrupted study has measured is kept, and not measured again."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from glshadow import __version__
from glshadow.core.cameras import Camera
from glshadow.errors import GlshadowError, SettingsError
from glshadow.lights import Light
from glshadow.scene.nodes import Scene
from glshadow.shadows.shadow import Shadow


class Journal:
    """The lines of one file, by key; `path` None keeps nothing.

    A line that an interruption cut off is dropped before anything is appended.

    Raises
    ------
    SettingsError
        If the file holds something else.
    """

    def __init__(self, path: str | os.PathLike[str] | None) -> None:
        self.path = None if path is None else Path(path)
        self.records: dict[str, dict[str, Any]] = {}
        if self.path is None or not self.path.exists():
            return
        data = self.path.read_bytes()
        whole = data.rfind(b"\n") + 1
        for number, line in enumerate(data[:whole].splitlines(), start=1):
            try:
                self._merge(json.loads(line))
            except (ValueError, TypeError, KeyError) as error:
                raise SettingsError(
                    f"{self.path}, line {number}, is no record of ours; give another file or delete it"
                ) from error
        if whole < len(data):
            with self.path.open("r+b") as file:
                file.truncate(whole)

    def add(self, record: dict[str, Any]) -> None:
        """Append a record with its "key", and wait until it is on the disk; later records add to earlier ones of their key.

        Raises
        ------
        GlshadowError
            If the file cannot take the whole line: then it has none of it.
        """
        if self.path is not None:
            line = (json.dumps(record, allow_nan=False, separators=(",", ":")) + "\n").encode()
            try:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                _append(self.path, line)
            except OSError as error:
                raise GlshadowError(f"cannot write {self.path}: {error.strerror or error}") from error
        self._merge(record)

    def _merge(self, record: dict[str, Any]) -> None:
        self.records[record["key"]] = {**self.records.get(record["key"], {}), **record}


def _append(path: Path, line: bytes) -> None:
    """All of it, or nothing."""
    with path.open("ab", buffering=0) as file:
        before = file.seek(0, os.SEEK_END)
        try:
            written = file.write(line)
            while written < len(line):  # a disk that is nearly full takes the beginning, and refuses the rest
                written += file.write(line[written:])
            os.fsync(file.fileno())
        except BaseException:
            file.truncate(before)
            raise


def fingerprint(scene: Scene) -> str:
    """Hash of everything that decides the scene's shadows: triangles, places, and alpha where it is tested."""
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
    """What makes two results the same measurement: scene (its fingerprint), picture, settings, machine and version."""
    facts = (scene, camera, light, tuple(size), shadow, machine, repeats, __version__)
    return hashlib.sha256(repr(facts).encode()).hexdigest()[:24]
