"""The public API: listed in one place, documented, and all that README and examples use."""

import re
from pathlib import Path
from types import ModuleType

import glshadow as gs
from glshadow.public import MODULES

CHECKOUT = Path(__file__).resolve().parents[1]
TEXTS = [CHECKOUT / "README.md", *sorted((CHECKOUT / "examples").glob("*.py"))]


def modules() -> dict[str, ModuleType]:
    return {name: value for name in gs.__all__ if isinstance(value := getattr(gs, name), ModuleType)}


def test_every_public_name_exists_and_is_documented() -> None:
    assert len(set(gs.__all__)) == len(gs.__all__)
    assert set(gs.__all__) == set(dir(gs))
    assert set(modules()) == {"batch", "image", "overlay", "scenes", "shaders", "study", "video"}
    assert {module.__name__ for module in modules().values()} < set(MODULES)
    public = [(f"gs.{name}", getattr(gs, name)) for name in gs.__all__ if name != "__version__"]
    public += [
        (f"gs.{owner}.{name}", getattr(module, name)) for owner, module in modules().items() for name in module.__all__
    ]
    for name, value in public:
        if callable(value) or isinstance(value, ModuleType):
            assert (value.__doc__ or "").strip(), name
            assert not (value.__doc__ or "").startswith(f"{getattr(value, '__name__', '')}("), (
                f"{name} has only dataclass's text"
            )


def test_documents_use_nothing_else() -> None:
    members = modules()
    for path in TEXTS:
        text = path.read_text()
        used = set(re.findall(r"\bgs\.(\w+)(?:\.(\w+))?", text)) | {
            (name, "") for name in re.findall(r"from glshadow import (\w+)", text)
        }
        for name, member in used:
            assert name in gs.__all__, (path.name, name)
            assert not member or name not in members or member in members[name].__all__, (path.name, name, member)
        imported = re.findall(r"(?:from|import) glshadow\.(\w+)", text)
        assert set(imported) <= set(members), path.name


def test_version_is_written_once() -> None:
    written = [
        path.name
        for path in (CHECKOUT / "pyproject.toml", *(CHECKOUT / "glshadow").rglob("*.py"))
        if re.search(rf"[\"']{re.escape(gs.__version__)}[\"']", path.read_text())
    ]
    assert written == ["__init__.py"]
