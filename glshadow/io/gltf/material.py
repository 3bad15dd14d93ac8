"""glTF materials: metallic-roughness, normal, occlusion and emissive maps, unlit ones; and how their textures are sampled."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow import image
from glshadow.core.setting import as_float, as_floats
from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.gltf.basisu import is_ktx2, ktx2_header, read_ktx2
from glshadow.io.gltf.broken import BROKEN, named
from glshadow.io.gltf.document import Document, as_object, extensions
from glshadow.io.gltf.transmission import transmission_of
from glshadow.io.imported import WHITE, alpha_mode, reflectance, solid
from glshadow.scene.mesh import MOST, Material
from glshadow.scene.texture import CLAMP, LINEAR, MAGNIFY, MINIFY, MIRROR, NEAREST, REPEAT, Sampler, Texture

_WRAPS = {33071: CLAMP, 33648: MIRROR, 10497: REPEAT}
_FILTERS = {9728: NEAREST, 9729: LINEAR, 9984: MINIFY[3], 9985: MINIFY[1], 9986: MINIFY[2], 9987: MINIFY[0]}


@dataclass(frozen=True)
class Surface:
    """A material as primitives use it.

    Parameters
    ----------
    material, given : Material
        `given`: BLEND if the file says so, even if nothing is transparent.
    uv_sets : tuple of int
        The TEXCOORD sets that its samplers number from 0: one or two.
    uv_transform : (3, 3) float64, optional
        A KHR_texture_transform that all its textures share, applied to the coordinates; those that differ are in the samplers.
    """

    material: Material = WHITE
    given: Material = WHITE
    uv_sets: tuple[int, ...] = (0,)
    uv_transform: Array | None = None


@dataclass
class Surfaces:
    """Materials and images of one document; each is made once and shared."""

    document: Document
    made: dict[int, Surface] = field(default_factory=dict)
    images: dict[int, NDArray[np.uint8] | None] = field(default_factory=dict)

    def get(self, index: Any, user: str) -> Surface:
        """Material `index`; None is glTF's default material, which a broken one is replaced by, with a note."""
        if index is None:
            return Surface()
        try:
            material = self.document.item("materials", index, user)
            if index not in self.made:
                self.made[index] = Surface()  # if it is broken
                self.made[index] = self._make(material, index)
        except BROKEN as error:
            self.document.notes.append(f"{named(error, f'materials[{index!r}]')}: drawn with the default material")
            return Surface()
        return self.made[index]

    def _make(self, given: dict[str, Any], index: int) -> Surface:
        where = f"materials[{index}]"
        extended = extensions(given)
        glossy = extended.get("KHR_materials_pbrSpecularGlossiness")
        stated = given.get("pbrMetallicRoughness")
        block = as_object({} if stated is None else stated, where) if glossy is None else as_object(glossy, where)
        names = ("baseColorFactor", "baseColorTexture") if glossy is None else ("diffuseFactor", "diffuseTexture")
        color = np.asarray(block.get(names[0], (1.0, 1.0, 1.0, 1.0)), dtype=np.float64)
        cutoff = float(given.get("alphaCutoff", 0.5))
        if color.shape != (4,) or not (np.isfinite(color).all() and np.isfinite(cutoff)):
            raise SceneError(
                f"{where}: {names[0]} must be 4 numbers and alphaCutoff one, got {color.tolist()} and {cutoff}"
            )
        unlit = "KHR_materials_unlit" in extended
        # a file that says nothing of reflection gets a matte surface, not glTF's default of a rough metal
        metal = stated is not None and glossy is None and not unlit
        maps = {
            "texture": (block, names[1]),
            "metallic_roughness_map": (block if metal else {}, "metallicRoughnessTexture"),
            "normal_map": ({} if unlit else given, "normalTexture"),
            "occlusion_map": ({} if unlit else given, "occlusionTexture"),
            "emission_map": ({} if unlit else given, "emissiveTexture"),
        }
        infos = {name: as_object(owner[key], f"{where}.{key}") for name, (owner, key) in maps.items() if key in owner}
        transmission, through = transmission_of(given, where, self.document.notes)
        if through is not None:
            infos["transmission_map"] = through
        pictures = {name: self._texture(info.get("index"), where) for name, info in infos.items()}
        infos = {name: info for name, info in infos.items() if pictures[name] is not None}
        placed = Placements(infos, where, self.document.notes)
        sampled = {name: self._sampler(info, placed.of[name]) for name, info in infos.items() if name in placed.of}
        base, passing = sampled.pop("texture", None), sampled.pop("transmission_map", None)
        if base is not None and passing is not None and not _same_place(base, passing):
            self.document.notes.append(
                f"{where}: its transmissionTexture has other coordinates than its base colour: drawn without it"
            )
            passing = None
        material = Material(
            color=reflectance(color, where, self.document.notes),  # type: ignore[arg-type]
            texture=None if base is None else pictures["texture"],
            sampler=base or passing or Sampler(),
            alpha_mode=alpha_mode(given.get("alphaMode")),
            cutoff=cutoff,
            double_sided=given.get("doubleSided") is True,
            transmission=transmission,
            transmission_map=None if passing is None else pictures["transmission_map"],
            cull_back_faces=given.get("doubleSided") is not True,
            metallic=_share(block, "metallicFactor", 1.0, where) if metal else 0.0,
            roughness=_share(block, "roughnessFactor", 1.0, where) if metal else None,
            normal_scale=_number(infos.get("normal_map", {}), "scale", 1.0, where),
            occlusion_strength=_share(infos.get("occlusion_map", {}), "strength", 1.0, where),
            emission=_emission(given, extended, where),  # type: ignore[arg-type]
            unlit=unlit,
            **{name: Texture(pictures[name], sampler) for name, sampler in sampled.items()},  # type: ignore[arg-type]
        )
        return Surface(solid(material), material, placed.sets, placed.shared)

    def _sampler(self, info: dict[str, Any], placement: tuple[int, Array | None]) -> Sampler:
        texture = self.document.item("textures", info.get("index"), "a texture")
        given = self.document.item("samplers", texture["sampler"], "a texture") if "sampler" in texture else {}
        wrap = tuple(_named_by(_WRAPS, given.get(key), REPEAT) for key in ("wrapS", "wrapT"))
        magnify = _named_by(_FILTERS, given.get("magFilter"), LINEAR)
        minify = _named_by(_FILTERS, given.get("minFilter"), MINIFY[0])
        return Sampler(wrap, magnify if magnify in MAGNIFY else LINEAR, minify, *placement)  # type: ignore[arg-type]

    def _texture(self, index: Any, user: str) -> NDArray[np.uint8] | None:
        """The image of texture `index`; one that is not there is left out with a note."""
        try:
            texture = self.document.item("textures", index, user)
        except SceneError as error:
            self._note(error)
            return None
        webp = as_object(extensions(texture).get("EXT_texture_webp", {}), user)
        basis = as_object(extensions(texture).get("KHR_texture_basisu", {}), user)
        source = webp.get("source", texture.get("source", basis.get("source")))
        if source is None:
            known = ", ".join(extensions(texture)) or "none"
            self.document.notes.append(
                f"textures[{index}] has no image that can be read (extensions: {known}): drawn without it"
            )
            return None
        if not isinstance(source, int):
            self._note(SceneError(f"textures[{index}].source must be an integer, got {source!r}"))
            return None
        if source not in self.images:
            self.images[source] = self._image(source, f"textures[{index}]")
        return self.images[source]

    def _image(self, index: Any, user: str) -> NDArray[np.uint8] | None:
        """The decoded image. A missing or broken image is left out with a note; one beyond the limits raises an error."""
        where = f"images[{index}]"
        budget = self.document.budget
        budget.check_time(where)
        try:
            given = self.document.item("images", index, user)
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


def _same_place(a: Sampler, b: Sampler) -> bool:
    identity = np.eye(3)
    one, other = (identity if each.transform is None else each.transform for each in (a, b))
    return a.uv_set == b.uv_set and np.array_equal(one, other)


class Placements:
    """By which texture coordinates a material's textures are placed.

    Attributes
    ----------
    sets : tuple of int
        TEXCOORD sets that are needed, one or two.
    shared : (3, 3) float64, optional
        The texture transform (v down) if all textures have the same one.
    of : dict
        Texture -> index in `sets`, and its transform (v up) if it is not the shared one.
    """

    def __init__(self, infos: dict[str, dict[str, Any]], where: str, notes: list[str]) -> None:
        found = {name: _placement(info) for name, info in infos.items()}
        different = {(uv_set, None if matrix is None else matrix.tobytes()) for uv_set, matrix in found.values()}
        self.shared = next(iter(found.values()))[1] if len(different) == 1 else None
        self.sets = tuple(dict.fromkeys(uv_set for uv_set, _ in found.values()))[:2] or (0,)
        self.of: dict[str, tuple[int, Array | None]] = {}
        for name, (uv_set, matrix) in found.items():
            if uv_set not in self.sets:
                notes.append(f"{where}: its {_named(name)} has a third set of texture coordinates: drawn without it")
                continue
            own = None if matrix is None or len(different) == 1 else _TURNED @ matrix @ _TURNED
            self.of[name] = self.sets.index(uv_set), own


_TURNED = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, 1.0]])  # v down to v up, and back


def _named_by(table: dict[int, str], number: Any, default: str) -> str:
    """What a number of OpenGL's stands for; the default for all others."""
    return table.get(number, default) if isinstance(number, int) else default


def _named(name: str) -> str:
    """A texture's name in notes."""
    return name.replace("_", " ")


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


def _number(block: dict[str, Any], name: str, default: float, where: str) -> float:
    value = as_float(block.get(name, default))
    if not np.isfinite(value):
        raise SceneError(f"{where}: {name} must be a finite number, got {block[name]!r}")
    return float(np.clip(value, -MOST, MOST))


def _share(block: dict[str, Any], name: str, default: float, where: str) -> float:
    return float(np.clip(_number(block, name, default, where), 0.0, 1.0))


def _emission(given: dict[str, Any], extended: dict[str, Any], where: str) -> tuple[float, ...]:
    """emissiveFactor times the strength of KHR_materials_emissive_strength."""
    factor = as_floats(given.get("emissiveFactor", (0.0, 0.0, 0.0)), (3,))
    if factor is None or not np.isfinite(factor).all():
        raise SceneError(f"{where}: emissiveFactor must be 3 finite numbers, got {given['emissiveFactor']!r}")
    block = as_object(extended.get("KHR_materials_emissive_strength", {}), where)
    strength = _number(block, "emissiveStrength", 1.0, where)
    return tuple(np.clip(factor * strength, 0.0, MOST).tolist())


def texture_uv(stored: Array, transform: Array | None) -> NDArray[np.float32]:
    """glTF's coordinates (V, 2), v down, as `Mesh.uv`: transformed, v up. Not finite if float32 cannot represent them."""
    with np.errstate(all="ignore"):
        uv = stored if transform is None else stored @ transform[:2, :2].T + transform[:2, 2]
        return np.stack([uv[:, 0], 1.0 - uv[:, 1]], axis=1).astype(np.float32)
