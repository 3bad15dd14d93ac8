"""glTF materials: base colour, its texture and the alpha mode; other properties are not supported."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow import image
from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.gltf.basisu import is_ktx2, ktx2_header, read_ktx2
from glshadow.io.gltf.document import Document, as_object, extensions
from glshadow.io.gltf.transmission import transmission_of
from glshadow.io.imported import WHITE, alpha_mode, reflectance, solid
from glshadow.scene.mesh import Material


@dataclass(frozen=True)
class Surface:
    """A material (`given`: BLEND if the file says so, even if nothing is transparent), the texture coordinate set of its texture,
    and its texture transform (3, 3)."""

    material: Material = WHITE
    given: Material = WHITE
    uv_set: int = 0
    uv_transform: Array | None = None


@dataclass
class Surfaces:
    """Materials and images of one document; each is made once and shared."""

    document: Document
    made: dict[int, Surface] = field(default_factory=dict)
    images: dict[int, NDArray[np.uint8] | None] = field(default_factory=dict)

    def get(self, index: Any, user: str) -> Surface:
        """Material `index`; None is glTF's default material."""
        if index is None:
            return Surface()
        material = self.document.item("materials", index, user)
        if index not in self.made:
            self.made[index] = self._make(material, index)
        return self.made[index]

    def _make(self, given: dict[str, Any], index: int) -> Surface:
        where = f"materials[{index}]"
        glossy = extensions(given).get("KHR_materials_pbrSpecularGlossiness")
        if glossy is None:
            block, names = (
                as_object(given.get("pbrMetallicRoughness", {}), where),
                ("baseColorFactor", "baseColorTexture"),
            )
        else:
            block, names = as_object(glossy, where), ("diffuseFactor", "diffuseTexture")
        color = np.asarray(block.get(names[0], (1.0, 1.0, 1.0, 1.0)), dtype=np.float64)
        cutoff = float(given.get("alphaCutoff", 0.5))
        if color.shape != (4,) or not (np.isfinite(color).all() and np.isfinite(cutoff)):
            raise SceneError(
                f"{where}: {names[0]} must be 4 numbers and alphaCutoff one, got {color.tolist()} and {cutoff}"
            )
        texture, uv_set, transform = None, 0, None
        if names[1] in block:
            info = as_object(block[names[1]], f"{where}.{names[1]}")
            texture = self._texture(info.get("index"), where)
            uv_set, transform = _placement(info)
        transmission, mapped = transmission_of(given, where, self.document.notes)
        transmission_map = None
        if mapped is not None:
            if texture is None:
                uv_set, transform = _placement(mapped)
            if texture is None or _same_place(_placement(mapped), (uv_set, transform)):
                transmission_map = self._texture(mapped.get("index"), where)
            else:
                self.document.notes.append(
                    f"{where}: its transmissionTexture has other coordinates than its base colour: drawn without it"
                )
        material = Material(
            color=reflectance(color, where, self.document.notes),  # type: ignore[arg-type]
            texture=texture,
            alpha_mode=alpha_mode(given.get("alphaMode")),
            cutoff=cutoff,
            double_sided=given.get("doubleSided") is True,
            transmission=transmission,
            transmission_map=transmission_map,
        )
        return Surface(solid(material), material, uv_set, transform)

    def _texture(self, index: Any, user: str) -> NDArray[np.uint8] | None:
        texture = self.document.item("textures", index, user)
        webp = as_object(extensions(texture).get("EXT_texture_webp", {}), user)
        basis = as_object(extensions(texture).get("KHR_texture_basisu", {}), user)
        source = webp.get("source", texture.get("source", basis.get("source")))
        if source is None:
            known = ", ".join(extensions(texture)) or "none"
            self.document.notes.append(
                f"textures[{index}] has no image that can be read (extensions: {known}): drawn without it"
            )
            return None
        if source not in self.images:
            self.images[source] = self._image(source, f"textures[{index}]")
        return self.images[source]

    def _image(self, index: Any, user: str) -> NDArray[np.uint8] | None:
        """The decoded image. A missing or broken image is left out with a note; one beyond the limits raises an error."""
        where = f"images[{index}]"
        given = self.document.item("images", index, user)
        budget = self.document.budget
        budget.check_time(where)
        try:
            source = self._source(given, where)
        except SceneError as error:
            self._note(error)
            return None
        if isinstance(source, Path):
            budget.announce(source, where)
        try:
            header = ktx2_header(source) if is_ktx2(source) else image.header(source)
        except SceneError as error:
            self._note(error)
            return None
        budget.take_image(header, where)
        try:
            return read_ktx2(source) if is_ktx2(source) else image.read(source)
        except SceneError as error:
            self._note(error)
            return None

    def _note(self, error: SceneError) -> None:
        self.document.notes.append(f"{error}; drawn without this texture")

    def _source(self, given: dict[str, Any], where: str) -> bytes | Path:
        uri = given.get("uri")
        if "bufferView" in given:
            return bytes(self.document.view(given["bufferView"], where)[0])
        if isinstance(uri, str) and uri.startswith("data:"):
            return self.document.resource(uri, where)
        return self.document.path(uri, where)


def _same_place(a: tuple[int, Array | None], b: tuple[int, Array | None]) -> bool:
    identity = np.eye(3)
    return a[0] == b[0] and np.array_equal(identity if a[1] is None else a[1], identity if b[1] is None else b[1])


def _placement(info: dict[str, Any]) -> tuple[int, Array | None]:
    """TEXCOORD set and KHR_texture_transform (v down) of a textureInfo."""
    extension = extensions(info).get("KHR_texture_transform")
    if extension is None:
        return int(info.get("texCoord", 0)), None
    block = as_object(extension, "KHR_texture_transform")
    (du, dv), (su, sv) = block.get("offset", (0.0, 0.0)), block.get("scale", (1.0, 1.0))
    angle_rad = float(block.get("rotation", 0.0))
    if not np.isfinite([du, dv, su, sv, angle_rad]).all():
        raise SceneError(f"KHR_texture_transform must be made of finite numbers, got {block}")
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    matrix = np.array([[c * su, s * sv, du], [-s * su, c * sv, dv], [0.0, 0.0, 1.0]], dtype=np.float64)
    return int(block.get("texCoord", info.get("texCoord", 0))), matrix


def texture_uv(stored: Array, transform: Array | None) -> NDArray[np.float32]:
    """glTF's coordinates (V, 2), v down, as `Mesh.uv`: transformed, v up. Not finite if float32 cannot represent them."""
    with np.errstate(all="ignore"):
        uv = stored if transform is None else stored @ transform[:2, :2].T + transform[:2, 2]
        return np.stack([uv[:, 0], 1.0 - uv[:, 1]], axis=1).astype(np.float32)
