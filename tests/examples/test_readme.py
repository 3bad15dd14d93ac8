"""The README's Python runs and prints what the README says."""

import re
import subprocess
import sys
from pathlib import Path

README = Path(__file__).parents[2] / "README.md"


def test_readme_code_prints_what_it_says(tmp_path: Path) -> None:
    text = README.read_text()
    code = re.search(r"```python\n(.*?)```", text, re.DOTALL)
    said = re.search(r"```text\n(\(720.*?)```", text, re.DOTALL)
    assert code
    assert said
    done = subprocess.run([sys.executable, "-c", code[1]], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "courtyard.png").exists()
    ours, theirs = done.stdout.splitlines(), said[1].splitlines()
    assert ours[0] == theirs[0]
    # The figures are llvmpipe's; another driver may move a pixel at an edge.
    assert re.sub(r"[\d.]+", "#", "\n".join(ours)) == re.sub(r"[\d.]+", "#", "\n".join(theirs))
    for a, b in zip(re.findall(r"[\d.]+", done.stdout), re.findall(r"[\d.]+", said[1]), strict=True):
        assert abs(float(a) - float(b)) <= 0.002 * abs(float(b)) + 0.002


def test_pictures_of_the_readme_exist() -> None:
    for name in re.findall(r"\]\((examples/[^)]+)\)", README.read_text()):
        assert (README.parent / name).is_file(), name
