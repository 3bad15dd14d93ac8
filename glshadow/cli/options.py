"""The options that all rendering commands share, and the Request that collects them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshadow.arguments import DEFAULT_SIZE
from glshadow.cli import values
from glshadow.cli.running import Work
from glshadow.cli.sections import LAST, all_of, option
from glshadow.core.spaces import Triple
from glshadow.core.spelling import vector
from glshadow.errors import SettingsError
from glshadow.scene.looks import LOOKS
from glshadow.shadows.bias import BIASES
from glshadow.shadows.fits import FITS

if TYPE_CHECKING:
    from glshadow.core.cameras import Camera
    from glshadow.lights import Light
    from glshadow.scene.nodes import Scene
from glshadow.scene.summary import element_counts

common = all_of(
    option(LAST, "--json", "as_json", is_flag=True, help="Print one JSON object on standard output."),
    option(LAST, "--debug", is_flag=True, help="Show the Python traceback of an error."),
)

size_option = option(
    "Image",
    "--size",
    metavar="WxH",
    read=values.size,
    default="{}x{}".format(*DEFAULT_SIZE),
    show_default=True,
    help="Pixels.",
)

driver_options = all_of(
    option("Image", "--backend", type=click.Choice(["auto", "egl", "osmesa", "window"]), default="auto",
           show_default=True, help="How to create the OpenGL context; auto uses the first that works."),
    option("Image", "--device", metavar="N", type=click.IntRange(0, 999),
           help="EGL device, as listed by `glshadow doctor`. Default: the first, a GPU if there is one."),
)  # fmt: skip

scene_options = all_of(
    click.argument("model", required=False, type=click.Path()),
    option("Model", "--ground/--no-ground", default=None,
           help="Put a plane under the model to catch its shadow. Default: in images of a model that has neither camera nor lights, "
                "except with --look plain, --background none, into .exr and .npz, and seen from below."),
    option("Model", "--catcher", is_flag=True,
           help="Put a shadow catcher under the model: only its shadow is visible. With --background none for compositing."),
    option("Model", "--look", type=click.Choice(list(LOOKS)),
           help="Camera, lights, background and ground that are not given: studio, plain (one hard light) or outdoor. Replaces the file's "
                "lights. Default: studio for images, else plain; the file's lights stay."),
    option("Model", "--up-axis", type=click.Choice(["x", "y", "z"]),
           help="Up axis of the file. Default: y; STL and PLY files often use z."),
    option("Model", "--smooth", metavar="DEGREES", read=values.degrees,
           help="Crease angle: a model without normals is shaded smoothly, except at edges where triangles meet at this angle or more: 30. "
                "Default: flat, or as the smoothing groups of an OBJ file say."),
    option("Model", "--time", metavar="S", read=values.seconds, help="Seconds of the file's animation. Default: the pose of its nodes."),
    option("Model", "--animation", metavar="NAME|N", help="Animation of the file, by name or by number, from 0. Default: the first."),
    option("Camera", "--camera", "through", metavar="NAME|N",
           help="A camera of the file, by its name or its number, from 0. Default: the first."),
    option("Camera", "--eye", metavar="X,Y,Z", read=vector,
           help="Position of the camera. Default: the file's camera, or one that frames the model."),
    option("Camera", "--target", metavar="X,Y,Z", read=vector,
           help="Point that the camera looks at. Default with --eye: the middle of the model."),
    option("Camera", "--up", metavar="X,Y,Z", read=vector, help="Up direction of the image. Default: 0,1,0."),
    option("Camera", "--fov", metavar="DEG", read=values.fov,
           help="Vertical field of view. Default: the file's, or 35 for the camera that frames the model, 50 with --eye."),
    option("Camera", "--ortho", metavar="HEIGHT", read=values.height,
           help="Orthographic camera; height of the image in world units. Not with --fov."),
    option("Camera", "--near", metavar="D", read=values.plane, help="Near plane of the camera. Default: derived."),
    option("Camera", "--far", metavar="D", read=values.plane, help="Far plane of the camera. Default: derived."),
    option("Lights", "--light", "lights", metavar="LIGHT", read=values.light, multiple=True,
           help=f"{values.light_help()}. d is the direction in which light travels, p the position. Any :key=value may follow: intensity=1 "
                "color=1,1,1 shadow=on|off, near=D far=D (shadow map), and the settings named above. Repeat for more lights. Default: "
                "the file's lights, or one directional light."),
    option("Lights", "--sky", metavar="INTENSITY", read=values.strength_of_sky,
           help="Also light from the whole sky, uniform: 0.4. Its shadow is ambient occlusion, at the cost of about 64 hard "
                "shadows."),
)  # fmt: skip

picture_options = all_of(
    option("Image", "-o", "--output", metavar="FILE", read=values.picture,
           help="The image to write: .png .jpg .tif, or .exr with all float outputs as channels, or .npz with arrays."),
    size_option,
    driver_options,
    scene_options,
    option("Image", "--ambient", metavar="A|R,G,B[/...]", read=values.ambient,
           help="Ambient light, linear; two values separated by a slash: from above and from below. "
                "Default: the look's; without light from all around 0.27/0.12, times the light that --exposure shows as white."),
    option("Image", "--background", metavar="R,G,B|none", read=values.background, default="look",
           help="Background colour in sRGB, each 0 to 1; none: transparent (.png .tif .exr). Default: the look's."),
    option("Shadow (of every light)", "--resolution", metavar="N", read=values.resolution,
           help="Texels along a side of the shadow map. Default: 2048."),
    option("Shadow (of every light)", "--filter", "filter_", metavar="FILTER", read=values.shadow_filter,
           help=f"{values.filter_help()}. Default: exact, if the driver can build triangle lists; otherwise, or with an option that "
                "needs a shadow map (--resolution, --bias, --target-format, --clip, --fit or --overlay map), pcf:1."),
    option("Shadow (of every light)", "--bias", metavar="BIAS", read=values.bias,
           help=f"Depth bias, which prevents surfaces from shadowing themselves: {', '.join(kind.usage() for kind in BIASES)}. "
                "receiver-plane is derived, slope is polygon offset, clip is Babylon's. Default: receiver-plane."),
    option("Shadow (of every light)", "--target-format", type=click.Choice(values.TARGETS),
           help="Format of the shadow map: depth* store window depth, the others the depth metric. Default: depth32f."),
    option("Shadow (of every light)", "--clip", metavar="CLIP", read=values.clip,
           help="Clip convention of the light: 0..1 or -1..1, either with ,reversed. Default: 0..1, reversed for spot "
                "and point."),
    option("Shadow (of every light)", "--fit", metavar="FIT", read=values.fit,
           help=f"What the shadow map covers: {', '.join(kind.usage() for kind in FITS)}. view: what the camera sees; scene: everything; "
                "cascades, for directional lights: COUNT maps, finer near the camera; lispsm: one perspective map. Default: view."),
    option("Shadow (of every light)", "--faces", type=click.Choice(["auto", "front", "back", "both"]),
           help="Faces that cast shadows. Default: auto, which culls back faces of closed meshes."),
    option("Shadow (of every light)", "--strength", metavar="S", read=values.strength,
           help="Share of the light that a shadow removes, 0 to 1. Default: 1."),
)  # fmt: skip


@dataclass(frozen=True)
class Request:
    """The values of the scene options, and of the image options if the command has them. `pictures`: of what is made to be looked at."""

    model: str | None
    ground: bool | None
    catcher: bool
    up_axis: str | None
    eye: Triple | None
    target: Triple | None
    up: Triple | None
    fov: float | None
    ortho: float | None
    near: float | None
    far: float | None
    lights: tuple[Light, ...]
    smooth: float | None = None
    through: str | None = None
    sky: float | None = None
    time: float | None = None
    animation: str | None = None
    size: tuple[int, int] = DEFAULT_SIZE
    backend: Any = "auto"
    device: int | None = None
    output: Path | None = None
    ambient: Any = None
    background: Triple | str | None = "look"
    look: str | None = None
    usual: str = "plain"
    pictures: bool = False
    exposure: Any = "scene"
    tone: str = "neutral"
    shadow: dict[str, Any] = field(default_factory=dict)

    @property
    def driver(self) -> Any:
        """The backend, or EGL on the requested device."""
        from glshadow.gl.driver.context import backend_of

        return backend_of(self.backend, self.device)

    @property
    def shown(self) -> dict[str, Any]:
        """Ambient light, background, exposure and tone map."""
        return {name: getattr(self, name) for name in ("ambient", "background", "exposure", "tone")}

    @property
    def name(self) -> str:
        """Name of the model in messages."""
        return Path(self.model).name if self.model else "courtyard"

    def load(self) -> Scene:
        """The scene, with the requested ground, or the look's."""
        given = {"--up-axis": self.up_axis, "--smooth": self.smooth, "--camera": self.through, "--time": self.time,
                 "--animation": self.animation}  # fmt: skip
        needing = [name for name, value in given.items() if value is not None]
        if self.catcher and self.ground is False:
            raise click.UsageError("--catcher and --no-ground cannot be combined: a shadow catcher is a ground")
        implied = self.ground is None and not self.catcher
        ground = "catcher" if self.catcher else self.ground if not implied else None if self.pictures else False
        if self.model is None and not needing:
            from glshadow.arguments import as_scene
            from glshadow.scenes import courtyard

            return as_scene(courtyard(), ground, self.look)
        if self.model is None:
            raise click.UsageError(f"{needing[0]} needs a MODEL")
        from glshadow.io.limits import Budget
        from glshadow.io.load import read_scene

        animation = int(self.animation) if self.animation and self.animation.isdecimal() else self.animation
        scene = read_scene(self.model, Budget(), ground, self.up_axis, None, None, self.through, self.smooth, self.time, animation,
                           self.look, self.usual)  # fmt: skip
        return replace(scene, nodes=scene.nodes[:-1]) if implied and self._below(scene) else scene

    def _below(self, scene: Scene) -> bool:
        """Whether the camera is under a ground, which would hide the model."""
        return self.eye is not None and any(
            each.ground and self.eye[1] <= each.world_from_mesh[1, 3] for each in scene.nodes
        )

    def camera(self, scene: Scene, turns: bool = False) -> Camera:
        """The scene's camera, changed by the given options; for an orbit, if it turns."""
        given: dict[str, Any] = {"position": self.eye, "target": self.target, "up": self.up}
        given |= {"near": self.near, "far": self.far}
        if self.eye is not None and self.target is None:
            given["target"] = tuple(float(x) for x in scene.bounds.mean(axis=0))
        if self.up is None and (self.eye is not None or self.target is not None):
            given["up"] = (0.0, 1.0, 0.0)  # the file's camera may have been tilted
        try:
            return replace(
                self._through_lens(scene.turning_camera if turns else scene.camera),
                **{name: value for name, value in given.items() if value is not None},
            )
        except SettingsError as error:
            raise click.UsageError(f"--eye, --target, --up, --near and --far cannot be combined: {error}") from error

    def _through_lens(self, camera: Camera) -> Camera:
        from glshadow.core.cameras import OrthographicCamera, PerspectiveCamera

        framing = isinstance(camera, PerspectiveCamera) and camera.aspect is not None
        if self.fov is not None and self.ortho is not None:
            raise click.UsageError(
                "--fov and --ortho cannot be combined: the camera is either perspective or orthographic"
            )
        if self.ortho is not None:
            return camera.through(OrthographicCamera, height=self.ortho)
        fov = self.fov
        if fov is None and framing and (self.eye is not None or self.target is not None):
            fov = 50.0  # what the default lens frames is not seen from there
        return camera if fov is None else camera.through(PerspectiveCamera, fov_y=fov, aspect=None)

    def lit(self, scene: Scene) -> tuple[Light, ...]:
        """The given lights, or the scene's, with the requested shadow settings."""
        lights = self.lights or scene.lights
        if self.sky is not None:
            from glshadow.lights import SkyLight

            lights = (*lights, SkyLight(intensity=self.sky))
        if not self.shadow:
            return lights
        # the look's fill would need a shadow map for each of its directions
        own = () if self.lights else [each for each in scene.lights if scene.look != "plain" and each.wide]
        return tuple(
            light
            if light.shadow is None or light in own
            else replace(light, shadow=replace(light.shadow, **self.shadow))
            for light in lights
        )


def request(
    *, filter_: Any, target_format: str | None, fit: str | None, faces: str | None, output: Path | None, **options: Any
) -> Request:
    """The options as one Request.

    Raises
    ------
    click.UsageError
        If shadow settings cannot be combined.
    """
    from glshadow.shadows.metric import Target
    from glshadow.shadows.shadow import Faces, Shadow

    shadow = {name: options.pop(name) for name in ("resolution", "bias", "clip", "strength")}
    shadow["filter"] = filter_
    shadow["target"] = None if target_format is None else Target(target_format)
    shadow["fit"] = fit
    shadow["faces"] = None if faces in (None, "auto") else Faces(faces)
    shadow = {name: value for name, value in shadow.items() if value is not None}
    try:
        Shadow(**shadow)
    except SettingsError as error:
        raise click.UsageError(f"the shadow options cannot be combined: {error}") from error
    return Request(output=output, shadow=shadow, **options)


def scene_facts(scene: Scene) -> dict[str, Any]:
    """Facts about the scene for the JSON report; counts of points and line segments only where there are any."""
    return {
        "name": scene.name,
        "nodes": len(scene.nodes),
        **element_counts(scene),
        "bounds": scene.bounds,
    }


def light_facts(light: Light, used: Any) -> dict[str, Any]:
    """A light and what was used for its shadow, for the JSON report."""
    from dataclasses import fields

    settings = {item.name: getattr(light, item.name) for item in fields(light) if item.name != "shadow"}
    return {"kind": light.spelling, **settings, "casts": light.shadow is not None, "used": used.as_dict()}


def warn_fallbacks(work: Work, used: tuple[Any, ...], scene: Scene, wanted: Request) -> None:
    """Warn about every setting that could not be used as given; not of the fill that a look adds, which nobody gave."""
    from glshadow.scene.framing import given_parts

    own = len(wanted.lights or (() if given_parts(scene)[1] is None else scene.lights))
    derived = 0 if own else len(scene.lights)
    for number, (light, what) in enumerate(zip(wanted.lit(scene), used, strict=True)):
        for fallback in what.fallbacks if number >= derived or not light.wide else ():
            work.warn(f"light {number}: {fallback}")
