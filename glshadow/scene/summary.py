"""One-line descriptions of scenes and their parts, and a scene's display in notebooks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from glshadow.core.setting import shown
from glshadow.core.spaces import Array
from glshadow.errors import listening

if TYPE_CHECKING:
    from glshadow.scene.mesh import Material, Mesh
    from glshadow.scene.nodes import Node, Scene

NAMES = 6  # node names in a scene's line
PICTURE = (640, 360)  # size of a scene's image in a notebook, pixels


def material_line(material: Material) -> str:
    """Colour, and settings that differ from their default."""
    parts = [f"({', '.join(f'{x:.4g}' for x in material.color)})"]
    if material.texture is not None:
        parts.append(f"texture {material.texture.shape[1]} x {material.texture.shape[0]}")
    if material.alpha_mode.value == "MASK":
        parts.append(f"MASK below {material.cutoff:.4g}")
    elif material.alpha_mode.value == "BLEND":
        parts.append("BLEND")
    if material.transmission > 0.0:
        parts.append(f"transmission {material.transmission:.4g}")
    if not material.matte:
        parts.append(
            f"metallic {material.metallic:.4g}, roughness {1.0 if material.roughness is None else material.roughness:.4g}"
        )
    parts += ["unlit"] * material.unlit + ["emissive"] * any(material.emission)
    parts += ["back faces culled"] * material.cull_back_faces
    return f"Material({', '.join(parts + ['double-sided'] * material.double_sided)})"


def mesh_line(mesh: Mesh) -> str:
    """Counts, attributes and bounds."""
    attributes = [name for name in ("normals", "uv", "colors") if getattr(mesh, name) is not None]
    parts = [f"{_elements([mesh])}, {len(mesh.positions):,} vertices", *attributes]
    if mesh.count:
        parts.append(_box(mesh.bounds))
    return f"{type(mesh).__name__}({', '.join(parts)}, {material_line(mesh.material)})"


def node_line(node: Node) -> str:
    """Name, mesh and origin of a node."""
    parts = [
        shown(node.name),
        _elements([node.mesh]),
        f"origin at {_point(node.world_from_mesh[:3, 3])}",
    ]
    parts += [
        word for word, off in (("casts no shadow", not node.casts), ("receives no shadow", not node.receives)) if off
    ]
    return f"Node({', '.join(parts)})"


def scene_line(scene: Scene) -> str:
    """Name, counts, bounds, and the names of the first nodes."""
    names = [shown(node.name) for node in scene.nodes[:NAMES]] + ["..."] * (len(scene.nodes) > NAMES)
    return f"Scene({shown(scene.name)}, {_facts(scene)}: {', '.join(names)})"


def _facts(scene: Scene) -> str:
    counts = (
        _counted(len(scene.nodes), "node"),
        _elements([node.mesh for node in scene.nodes]),
        _counted(len(scene.lights), "light"),
    )
    return f"{', '.join(counts)}, {_box(scene.bounds)}"


def scene_html(scene: Scene) -> str:
    """A small image with the scene's own camera and lights, and a caption; only the caption if no image can be rendered."""
    from glshadow.inline import figure, words

    caption = f"{scene.name}: {_facts(scene)}"
    try:
        from glshadow.renderer import Renderer

        with listening(lambda _: None), Renderer() as renderer:
            return figure(renderer.render(scene, size=PICTURE, outputs=("image",), samples=1).image, caption)
    except Exception:  # no driver, no memory, or any other reason: displaying a scene must not fail
        return f"<p>{words(caption)}</p>"


def _elements(meshes: Sequence[Mesh]) -> str:
    """Counts of triangles, points and line segments; where there is nothing, none of the first kind."""
    counts: dict[str, int] = {}
    for mesh in meshes:
        counts[mesh.element] = counts.get(mesh.element, 0) + mesh.count
    drawn = {name: count for name, count in counts.items() if count} or {next(iter(counts), "triangle"): 0}
    return ", ".join(_counted(count, name) for name, count in drawn.items())


def _counted(number: int, word: str) -> str:
    return f"{number:,} {word}{'' if number == 1 else 's'}"


def _point(point: Array) -> str:
    return f"({', '.join(f'{x:.4g}' for x in point)})"


def _box(bounds: Array) -> str:
    return f"from {_point(bounds[0])} to {_point(bounds[1])}"


def element_counts(scene: Scene) -> dict[str, int]:
    """Counts of triangles, and of points and line segments if a scene has any, by these names."""
    counts = {"triangles": 0}
    for mesh in (node.mesh for node in scene.nodes):
        counts[f"{mesh.element}s"] = counts.get(f"{mesh.element}s", 0) + mesh.count
    return counts
