"""What is drawn of glTF: its features and extensions, with how each is drawn. Notes and the table of docs/files.md are made from it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

DRAWN, APPROXIMATED, LEFT_OUT, REFUSED = "drawn", "approximated", "left out", "refused"


class Feature(NamedTuple):
    """How a feature is drawn, and what differs from what the file says."""

    how: str
    remark: str = ""


MOST_NAMED = 20  # extensions in one note
UNKNOWN = Feature(LEFT_OUT, "not known")
_NOTHING = Feature(DRAWN, "nothing in it is visible")

EXTENSIONS: dict[str, Feature] = {
    "KHR_animation_pointer": Feature(
        DRAWN, "of translations, rotations, scales and weights of nodes; of all else left out, with a note"
    ),
    "KHR_draco_mesh_compression": Feature(DRAWN, "with `pip install DracoPy`; refused without"),
    "KHR_gaussian_splatting": Feature(LEFT_OUT, "splats"),
    "KHR_interactivity": _NOTHING,
    "KHR_lights_punctual": Feature(DRAWN, "a spot's cone up to 89 degrees from its axis; candela and lux are exposed"),
    "KHR_materials_anisotropy": Feature(LEFT_OUT, "stretched highlights"),
    "KHR_materials_clearcoat": Feature(LEFT_OUT, "the coat"),
    "KHR_materials_diffuse_transmission": Feature(LEFT_OUT, "light that comes through, diffusely"),
    "KHR_materials_dispersion": Feature(LEFT_OUT, "colours of refraction"),
    "KHR_materials_emissive_strength": Feature(DRAWN),
    "KHR_materials_ior": Feature(LEFT_OUT, "the index of refraction"),
    "KHR_materials_iridescence": Feature(LEFT_OUT, "colours of thin films"),
    "KHR_materials_pbrSpecularGlossiness": Feature(APPROXIMATED, "its diffuse colour, without the specular one"),
    "KHR_materials_sheen": Feature(LEFT_OUT, "the sheen of cloth"),
    "KHR_materials_specular": Feature(LEFT_OUT, "strength and colour of the highlight"),
    "KHR_materials_transmission": Feature(APPROXIMATED, "a thin wall: neither bent nor blurred"),
    "KHR_materials_unlit": Feature(DRAWN),
    "KHR_materials_variants": Feature(DRAWN, "the default variant"),
    "KHR_materials_volume": Feature(LEFT_OUT, "thickness and absorption"),
    "KHR_mesh_quantization": Feature(DRAWN),
    "KHR_meshopt_compression": Feature(DRAWN, "with `pip install 'glshadow[gltf]'`; refused without"),
    "KHR_node_hoverability": _NOTHING,
    "KHR_node_selectability": _NOTHING,
    "KHR_node_visibility": Feature(DRAWN),
    "KHR_texture_basisu": Feature(
        DRAWN, "with `pip install 'glshadow[gltf]'`; without, the base image, or none, with a note"
    ),
    "KHR_texture_transform": Feature(DRAWN),
    "KHR_xmp_json_ld": _NOTHING,
    "EXT_instance_features": _NOTHING,
    "EXT_lights_ies": Feature(APPROXIMATED, "the light without its profile"),
    "EXT_lights_image_based": Feature(LEFT_OUT, "its light"),
    "EXT_mesh_features": _NOTHING,
    "EXT_mesh_gpu_instancing": Feature(DRAWN),
    "EXT_mesh_manifold": _NOTHING,
    "EXT_meshopt_compression": Feature(DRAWN, "with `pip install 'glshadow[gltf]'`; refused without"),
    "EXT_structural_metadata": _NOTHING,
    "EXT_texture_avif": Feature(LEFT_OUT, "the base image, or none"),
    "EXT_texture_webp": Feature(DRAWN),
    "ADOBE_materials_clearcoat_specular": Feature(LEFT_OUT, "the coat"),
    "ADOBE_materials_thin_transparency": Feature(LEFT_OUT, "transparency: drawn opaque"),
    "AGI_articulations": Feature(DRAWN, "at rest"),
    "CESIUM_primitive_outline": Feature(LEFT_OUT, "lines along edges"),
    "CESIUM_RTC": Feature(APPROXIMATED, "about the model's own origin"),
    "KHR_techniques_webgl": Feature(LEFT_OUT, "shaders"),
    "KHR_xmp": _NOTHING,
    "MSFT_lod": Feature(DRAWN, "the finest level"),
    "MSFT_packing_normalRoughnessMetallic": Feature(DRAWN, "from the textures that it packs"),
    "MSFT_packing_occlusionRoughnessMetallic": Feature(DRAWN, "from the textures that it packs"),
    "MSFT_texture_dds": Feature(LEFT_OUT, "the base image, or none"),
}
"""Ratified extensions, those of several vendors, and others that are often found in files."""

CORE: dict[str, Feature] = {
    "GLB, .gltf with .bin or data: URIs": Feature(
        DRAWN, "files in the model's folder and below; bytes behind a GLB's end are ignored"
    ),
    "glTF 1.0": Feature(REFUSED, "convert it first"),
    "nodes: matrix, translation, rotation, scale": Feature(DRAWN, "composed in float64"),
    "several scenes": Feature(APPROXIMATED, "the default one"),
    "triangles, strips, fans": Feature(DRAWN),
    "points, lines": Feature(DRAWN, "as balls and tubes"),
    "sparse, interleaved and normalised accessors": Feature(DRAWN),
    "POSITION, NORMAL, COLOR_0, JOINTS_n, WEIGHTS_n": Feature(DRAWN, "without NORMAL: flat"),
    "TEXCOORD_n": Feature(DRAWN, "the set that the texture names"),
    "TANGENT": Feature(DRAWN, "without it, from the texture coordinates"),
    "skins, morph targets": Feature(DRAWN, "in the pose of the file's nodes and weights"),
    "animations": Feature(DRAWN, "`Scene.at`; without a time at rest"),
    "perspective and orthographic cameras": Feature(
        DRAWN, "by yfov and ymag; znear and zfar are derived; all of them in `Scene.cameras`"
    ),
    "base colour, factor and texture": Feature(DRAWN),
    "metallic-roughness": Feature(DRAWN, "reflects lights, not an environment"),
    "normal, occlusion and emissive textures": Feature(DRAWN),
    "alphaMode MASK": Feature(DRAWN, "shadows too"),
    "alphaMode BLEND": Feature(DRAWN, "in layers; its shadow is tinted"),
    "doubleSided: false": Feature(
        DRAWN, "the camera sees through triangles from behind; they cast shadows all the same"
    ),
    "samplers": Feature(DRAWN),
    "PNG, JPEG": Feature(DRAWN, "wider than the driver allows: scaled down, with a note"),
    "broken primitives": Feature(LEFT_OUT, "with a note; of a primitive with some broken triangles, these"),
}
"""Features of glTF 2.0 itself, and what becomes of broken files."""


def can_be_required(name: str) -> bool:
    """Whether a file that requires this extension is drawn all the same; extensions of materials change the shading alone."""
    known = EXTENSIONS.get(name)
    return name.startswith("KHR_materials_") or (known is not None and known.how in (DRAWN, APPROXIMATED))


def notes_on(used: Iterable[str]) -> list[str]:
    """The note on extensions that are not drawn as the file says, each by name."""
    found = []
    for name in used:
        feature = EXTENSIONS.get(name, UNKNOWN)
        if feature.how in (APPROXIMATED, LEFT_OUT):
            found.append(f"{name[:60]} is {feature.how}" + (f" ({feature.remark})" if feature.remark else ""))
    more = ["..."] if len(found) > MOST_NAMED else []
    return ["; ".join(found[:MOST_NAMED] + more)] if found else []
