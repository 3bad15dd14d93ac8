"""A technique, and a light, is defined in one place: no pass, command or study tests which filter, bias, fit, technique or light it has."""

from __future__ import annotations

import ast
import inspect
import re
from dataclasses import fields
from pathlib import Path

import pytest

import glshadow
from glshadow.gl import techniques as sources
from glshadow.lights import LIGHTS, Light
from glshadow.shadows.bias import BIASES
from glshadow.shadows.filters import FILTERS
from glshadow.shadows.filters.filter import Needs
from glshadow.shadows.fits import FITS

PACKAGE = Path(glshadow.__file__).parent
FAMILIES = {kind.__name__: "shadows/filters" for kind in FILTERS}
FAMILIES |= {kind.__name__: "shadows/bias.py" for kind in BIASES}
FAMILIES |= {kind.__name__: "shadows/fits.py" for kind in FITS}
FAMILIES |= {name: "gl/techniques" for name in sources.__all__ if name[0].isupper()}
FAMILIES |= {"Filter": "shadows/filters", "Bias": "shadows/bias.py", "Fit": "shadows/fits.py"}
FAMILIES |= {base.__name__: "lights" for kind in LIGHTS for base in kind.__mro__ if issubclass(base, Light)}

KINDS = {kind.spelling for kind in LIGHTS} | {"directional", "panel", "lamp"}
"""Names of kinds of lights in strings."""

# Places that may name kinds of lights in strings: (file, reason).
NAMED = {
    "io/gltf/read.py": "the words of KHR_lights_punctual",
    "__init__.py": "the function gs.sun",
}

# Places that may test for a class: (file, class), with the reason.
ALLOWED: dict[tuple[str, str], str] = {
    ("ui/compare.py", "Filter"): "any filter stands for the Shadow that has it",
}


def type_tests() -> list[tuple[str, int, str]]:
    """Every isinstance, `type(x) is` and match on a class of a family outside the family's own place: file, line, class."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            tested: list[ast.AST] = []
            if (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Name)
                and node.func.id in ("isinstance", "issubclass")
            ):
                tested = [node.args[1]]
            elif isinstance(node, ast.Compare) and any(_is_type_call(part) for part in (node.left, *node.comparators)):
                tested = [node]
            elif isinstance(node, ast.MatchClass):
                tested = [node.cls]
            for part in tested:
                names = {each.id for each in ast.walk(part) if isinstance(each, ast.Name)}
                names |= {each.attr for each in ast.walk(part) if isinstance(each, ast.Attribute)}
                for family in names & set(FAMILIES):
                    if not name.startswith(FAMILIES[family]):
                        found.append((name, node.lineno, family))
    return found


def kind_strings() -> list[tuple[str, int, str]]:
    """Every comparison with the name of a kind of light, and every table keyed by it, outside lights: file, line, word."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if name.startswith("lights/"):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            tested: list[ast.AST | None] = []
            if isinstance(node, ast.Compare):
                tested = [node.left, *node.comparators]
            elif isinstance(node, ast.Dict):
                tested = list(node.keys)
            elif isinstance(node, ast.Subscript):
                tested = [node.slice]
            elif isinstance(node, ast.MatchValue):
                tested = [node.value]
            for part in filter(None, tested):
                several = part.elts if isinstance(part, ast.Tuple | ast.List | ast.Set) else [part]
                found += [
                    (name, node.lineno, str(each.value))
                    for each in several
                    if isinstance(each, ast.Constant) and each.value in KINDS
                ]
    return found


def _is_type_call(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "type"


def test_no_code_tests_which_technique_or_light_it_has() -> None:
    assert [each for each in type_tests() if (each[0], each[2]) not in ALLOWED] == []


def test_no_string_identifies_a_kind_of_light() -> None:
    assert [each for each in kind_strings() if each[0] not in NAMED] == []


@pytest.mark.parametrize("kind", LIGHTS, ids=lambda kind: kind.spelling)
def test_light_class_is_complete(kind: type[Light]) -> None:
    assert kind.__name__ in glshadow.__all__
    assert getattr(glshadow, kind.__name__) is kind
    assert kind.usage.split(":")[0] == kind.spelling
    assert kind.summary
    assert set(kind.by_place) <= {each.name for each in fields(kind)}
    assert kind.beside_geometry <= {each.name for each in fields(kind)}
    assert not kind.sized_by or kind.sized_by in {each.name for each in fields(kind)}
    assert kind.most_views in (0, 1, 6)
    assert kind.most_views == (6 if kind.projection == "cube" else kind.most_views)
    assert (PACKAGE.parent / "glsl" / kind.snippet).is_file()
    assert Path(inspect.getfile(kind)).parent == PACKAGE / "lights"
    assert len({each.spelling for each in LIGHTS}) == len({each.snippet for each in LIGHTS}) == len(LIGHTS)


@pytest.mark.parametrize("kind", FILTERS, ids=lambda kind: kind.spelling)
def test_filter_class_is_complete(kind: type[glshadow.Filter]) -> None:
    assert kind.__name__ in glshadow.__all__
    assert getattr(glshadow, kind.__name__) is kind
    assert kind.spelling == kind.__name__.lower()
    assert kind.summary
    assert kind.source
    assert kind.fails
    for settings in (kind(), *kind.variants(), *kind.rungs(), *kind.studied(), *kind.extremes()):
        assert bool(settings.snippet) == settings.has_map
        assert bool(settings.encoding) == bool(settings.channels) == (settings.needs is Needs.MOMENTS)
        assert settings.reach_texels >= settings.radius
    assert len({each.spelling for each in FILTERS}) == len(FILTERS)


def test_filter_without_a_snippet_is_refused() -> None:
    """A technique that is only added to the list must not give another one's image."""
    from dataclasses import dataclass

    from glshadow.shadows.filters.filter import Needs

    @dataclass(frozen=True)
    class Unfinished(glshadow.Filter):
        spelling = "unfinished"
        needs = Needs.COMPARISON

    light = glshadow.DirectionalLight(shadow=glshadow.Shadow(filter=Unfinished()))
    with glshadow.Renderer() as renderer, pytest.raises(glshadow.SettingsError, match=r"Unfinished\(\) has no snippet"):
        renderer.render(glshadow.scenes.courtyard(), lights=[light], size=(32, 18), samples=1)


def test_code_for_software_drivers_is_documented() -> None:
    """Each place that tests for a software driver is in the table of docs/speed.md, with its measurement."""
    testing = {
        path.relative_to(PACKAGE.parent).as_posix()
        for path in PACKAGE.rglob("*.py")
        if "caps.software" in path.read_text()
    }
    table = (PACKAGE.parent / "docs" / "speed.md").read_text()
    assert testing == set(re.findall(r"\| `(glshadow/gl/[\w/]+\.py)` \|", table))


def test_double_is_used_only_where_a_driver_without_it_has_another_way() -> None:
    """By GLS_DOUBLE 0: pairs of floats, and plain floats."""
    glsl = PACKAGE.parent / "glsl"
    found = {
        path.relative_to(glsl).as_posix()
        for path in glsl.rglob("*.*")
        if re.search(r"^[^/]*\b(double|d(vec|mat)\d)\b", path.read_text(), re.MULTILINE)
    }
    assert found == {"lib/placed.glsl", "lib/ray_triangle.glsl"}
    assert all("#if GLS_DOUBLE" in (glsl / name).read_text() for name in found)


def test_no_file_exceeds_the_line_limit() -> None:
    long = {path.name for path in PACKAGE.rglob("*.py") if len(path.read_text().splitlines()) > 350}
    assert long == set()
