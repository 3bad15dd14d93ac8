"""The two commands: what they set up, in which order, how fast the second time, and what they print if they cannot.

A stand-in for python3 notes its calls, so that nothing is installed and no network is needed.
"""

import importlib.util
import resource
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import pytest

from .tolerances import PATIENCE_S

CHECKOUT = Path(__file__).resolve().parents[1]

# Answers the version check with its own exit code, makes a .venv that contains a copy of itself, and records all other calls.
FAKE_PYTHON = """#!/bin/bash
case "$*" in
    *version_info*) exit "${FAKE_TOO_OLD:-0}" ;;
    *ensurepip*) exit "${FAKE_NO_VENV:-0}" ;;
    --version) echo "Python 3.11.0"; exit ;;
    "- "*) exit 0 ;;
esac
echo "$*" >> "$FAKE_LOG"
if [[ "$1 $2" == "-m venv" ]]; then mkdir -p "${@: -1}/bin"; cp "$0" "${@: -1}/bin/python"; fi
if [[ "$1 $2 $3" == "-m pip install" ]]; then exit "${FAKE_NO_NETWORK:-0}"; fi
if [[ "$*" == */libraries.py ]]; then printf '%b' "${FAKE_MISSING:-}"; fi
"""


@dataclass(frozen=True)
class Sandbox:
    """A checkout with nothing but the scripts, and a PATH whose python3 is the stand-in."""

    root: Path
    environment: dict[str, str]

    def run(self, script: str, *arguments: str, cwd: Path | None = None, **environment: str) -> tuple[int, str]:
        """Exit code and standard error."""
        done = subprocess.run(
            [self.root / "scripts" / script, *arguments],
            cwd=cwd or self.root,
            env=self.environment | environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )
        assert done.stdout == "", "set-up prints to standard error only"
        return done.returncode, done.stderr

    def calls(self) -> list[str]:
        """Calls of the stand-in since the last time, without the paths."""
        log = Path(self.environment["FAKE_LOG"])
        text = log.read_text() if log.exists() else ""
        log.unlink(missing_ok=True)
        return [line.replace(str(self.root), "ROOT") for line in text.splitlines()]


@pytest.fixture
def sandbox(tmp_path: Path) -> Sandbox:
    root = tmp_path / "a checkout"
    root.mkdir()
    shutil.copytree(CHECKOUT / "scripts", root / "scripts")
    shutil.copy(CHECKOUT / "pyproject.toml", root)
    programs = tmp_path / "bin"
    programs.mkdir()
    for name in ("python3", "Xvfb", "glslangValidator"):
        (programs / name).write_text(FAKE_PYTHON)
        (programs / name).chmod(0o755)
    # Not root, and therefore no installation by apt-get, wherever these tests run.
    (programs / "id").write_text("#!/bin/sh\necho 1000\n")
    (programs / "id").chmod(0o755)
    environment = {
        "PATH": f"{programs}:/usr/bin:/bin",
        "HOME": str(tmp_path),
        "FAKE_LOG": str(tmp_path / "log"),
    }
    return Sandbox(root, environment)


INSTALL = "-m pip install --quiet --disable-pip-version-check --no-input --editable ROOT"
LIBRARIES = "ROOT/scripts/libraries.py"


def _processor_time(call: Callable[[], object]) -> float:
    """Seconds of the processes that a call starts, the minimum of five."""
    taken = []
    for _ in range(5):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        call()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        taken.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(taken)


def _empty_shell() -> None:
    subprocess.run(["bash", "-c", ":"], check=True)


def test_first_call_sets_up_and_second_is_immediate(sandbox: Sandbox, tmp_path: Path) -> None:
    code, said = sandbox.run("render", "model.glb", "-o", "a b.png", cwd=tmp_path)
    assert code == 0
    assert "making the virtual environment" in said
    assert sandbox.calls() == [
        "-m venv --clear ROOT/.venv",
        INSTALL,
        LIBRARIES,
        "-m glshadow render model.glb -o a b.png",
    ]

    assert sandbox.run("render") == (0, "")
    assert sandbox.calls() == ["-m glshadow render"]
    # the promise of the README: no more processor time than some empty shells (measured: 9)
    again, empty = (_processor_time(call) for call in (lambda: sandbox.run("render"), _empty_shell))
    assert again < 30.0 * empty


def test_changed_dependencies_are_installed_again(sandbox: Sandbox) -> None:
    sandbox.run("render")
    sandbox.calls()
    with (sandbox.root / "pyproject.toml").open("a") as file:
        file.write("\n# another dependency\n")
    sandbox.run("render")
    assert sandbox.calls() == ["-m pip --version", INSTALL, LIBRARIES, "-m glshadow render"]


def test_test_script_passes_tools_and_arguments(sandbox: Sandbox, tmp_path: Path) -> None:
    sandbox.run("test", "tests/gl", "-k", "depth or clip", cwd=tmp_path)
    assert sandbox.calls() == [
        "-m venv --clear ROOT/.venv",
        f"{INSTALL}[dev]",
        LIBRARIES,
        "-m pytest tests/gl -k depth or clip",
    ]


@pytest.mark.parametrize(("arguments", "chosen"), [([], " -m not exhaustive"), (["--all"], "")], ids=str)
def test_without_arguments_everything_is_checked_first(sandbox: Sandbox, arguments: list[str], chosen: str) -> None:
    sandbox.run("test", *arguments)
    calls = sandbox.calls()
    ran = [call.split()[1] for call in calls[3:]]
    assert ran[0] == "ruff"
    assert ran[-1] == "pytest"
    assert {"ruff", "mypy", "codespell_lib", "scripts.words", "--check", "scripts.shaders.validate"} <= set(ran)
    assert calls[-1] == f"-m pytest -n 2 --dist loadscope --no-loadscope-reorder{chosen}"


def test_a_failed_check_fails_after_all_checks_ran(sandbox: Sandbox) -> None:
    sandbox.run("check")
    sandbox.calls()
    python = sandbox.root / ".venv" / "bin" / "python"
    python.write_text(FAKE_PYTHON + '[[ "$2" != mypy ]]\n')
    code, said = sandbox.run("check")
    assert code == 1
    assert "failed: mypy" in said
    assert any("codespell" in call for call in sandbox.calls())


def test_too_old_python_is_reported(sandbox: Sandbox) -> None:
    for name in ("python3.11", "python3.12", "python3.13", "python3.14"):
        shutil.copy(Path(sandbox.environment["PATH"].split(":")[0]) / "python3", sandbox.root.parent / "bin" / name)
    code, said = sandbox.run("render", FAKE_TOO_OLD="1")
    assert code == 1
    assert "Python 3.11 or newer is needed" in said
    assert sandbox.calls() == []


def test_missing_venv_module_names_the_package(sandbox: Sandbox) -> None:
    code, said = sandbox.run("render", FAKE_NO_VENV="1")
    assert code == 1
    assert "as root run: apt-get install python3-venv" in said


def test_interrupted_set_up_resumes(sandbox: Sandbox) -> None:
    code, said = sandbox.run("render", FAKE_NO_NETWORK="1")
    assert code == 1
    assert "pip could not install" in said
    sandbox.calls()
    code, _ = sandbox.run("render")
    assert code == 0
    assert sandbox.calls() == ["-m pip --version", INSTALL, LIBRARIES, "-m glshadow render"]


FAKE_APT = """#!/bin/bash
echo "apt-get $*" >> "$FAKE_LOG"
[[ $1 == update || $(grep -c update "$FAKE_LOG") -gt 0 ]]
"""
APT_INSTALL = "apt-get install --yes --quiet --no-install-recommends"


@pytest.fixture
def as_root(sandbox: Sandbox) -> Sandbox:
    """A fresh image has no package lists: the first apt-get install fails, the one after the update works."""
    programs = Path(sandbox.environment["PATH"].split(":")[0])
    (programs / "id").write_text("#!/bin/sh\necho 0\n")
    (programs / "apt-get").write_text(FAKE_APT)
    (programs / "apt-get").chmod(0o755)
    return sandbox


def test_root_installs_what_is_missing_after_an_update(as_root: Sandbox) -> None:
    code, said = as_root.run("render", FAKE_NO_VENV="1")
    assert code == 0
    assert "Python's venv module is missing; installing python3-venv" in said
    install = f"{APT_INSTALL} python3-venv"
    assert as_root.calls()[:4] == [install, "apt-get update --quiet", install, "-m venv --clear ROOT/.venv"]


def test_libraries_that_wheels_need_are_installed(as_root: Sandbox) -> None:
    code, said = as_root.run("render", FAKE_MISSING="libatomic1\\nzlib1g\\n")
    assert code == 0
    assert "what is in .venv needs libatomic1 zlib1g" in said
    install = f"{APT_INSTALL} libatomic1 zlib1g"
    assert as_root.calls()[2:6] == [LIBRARIES, install, "apt-get update --quiet", install]


def test_without_root_missing_libraries_are_named(sandbox: Sandbox) -> None:
    code, said = sandbox.run("render", FAKE_MISSING="libatomic1\\n")
    assert code == 1
    assert "as root run: apt-get install libatomic1" in said
    assert sandbox.run("render")[0] == 0


# -- a bare machine

FAKES = {
    "debootstrap": """
        for folder; do [[ $folder == /* ]] && break; done
        mkdir -p "$folder"/{usr/bin,etc/apt/apt.conf.d}
        cp "$0" "$folder/usr/bin/python3\"""",
    "git": "tar -cT /dev/null",
    "mount": 'echo "mount $*" >> "$FAKE_LOG"',
    "umount": 'echo "umount $*" >> "$FAKE_LOG"',
    "mountpoint": "true",
    "chroot": """
        echo "run ${@: -1}" >> "$FAKE_LOG"
        case "$*" in
            *scripts/render) echo picture > "$1/src/main/courtyard.png" ;;
            *scripts/test*) echo "$FAKE_COUNTS"; exit "$FAKE_CODE" ;;
        esac""",
}


@pytest.mark.parametrize(
    ("counts", "code"),
    [("5 passed in 1.00s", 0), ("1 failed, 4 passed in 1.00s", 1), ("4 passed, 1 skipped in 1.00s", 0)],
)
def test_a_bare_machine_is_unmounted_and_removed_whatever_happens(as_root: Sandbox, counts: str, code: int) -> None:
    programs = Path(as_root.environment["PATH"].split(":")[0])
    for name, body in FAKES.items():
        (programs / name).write_text(f"#!/bin/bash\n{body}\n")
        (programs / name).chmod(0o755)
    done = subprocess.run(
        [as_root.root / "scripts" / "bare", "--all"],
        env=as_root.environment | {"FAKE_COUNTS": counts, "FAKE_CODE": str(code)},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.returncode == (0 if counts.startswith("5") else 1), done.stderr
    assert counts in done.stderr
    calls = as_root.calls()
    (folder,) = {call.split()[-1].removesuffix("/proc") for call in calls if call.endswith("/proc")}
    assert not Path(folder).exists()
    made = [call.split()[-1] for call in calls if call.startswith("mount") and "remount" not in call]
    unmade = [call.split()[-1] for call in calls if call.startswith("umount")]
    assert made == [f"{folder}/proc", f"{folder}/dev"]
    assert unmade == made[::-1]
    assert [call for call in calls if call.startswith("run")] == ["run scripts/render", "run --all"]


def test_a_bare_machine_needs_root_and_debootstrap(sandbox: Sandbox) -> None:
    code, said = sandbox.run("bare")
    assert code == 1
    assert "scripts/bare needs root" in said


# -- libraries that the wheels need


@pytest.fixture
def libraries(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(CHECKOUT / "scripts")
    return importlib.import_module("libraries")


@pytest.mark.parametrize("package", ["numpy", "OpenImageIO"])
def test_needed_libraries_match_the_loader(libraries: ModuleType, package: str) -> None:
    folder = Path(importlib.util.find_spec(package).submodule_search_locations[0])
    found = set()
    for path in [path for path in sorted(folder.rglob("*.so*")) if path.is_file()][:5]:
        said = subprocess.run(["ldd", path], capture_output=True, text=True, check=True).stdout
        needed = set(libraries.needed(path))
        assert needed <= {Path(line.split()[0]).name for line in said.splitlines()}
        found |= needed
    assert {"libc.so.6", "libm.so.6"} <= found
    assert libraries.needed(CHECKOUT / "pyproject.toml") == []


def test_missing_and_unknown_libraries_are_named(
    libraries: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert libraries.main(check=True) == 0
    monkeypatch.setattr(libraries, "loads", lambda name: name != "libatomic.so.1")
    assert libraries.main(check=False) == 0
    assert capsys.readouterr().out == "libatomic1\n"
    monkeypatch.delitem(libraries.PACKAGES, "libz.so.1")
    assert libraries.main(check=True) == 1
    said = capsys.readouterr().err
    assert "libatomic.so.1, which drjit/libnanothread.so needs, is missing: apt-get install libatomic1" in said
    assert "libz.so.1, which " in said
    assert "has no package in PACKAGES of scripts/libraries.py" in said
