"""The journal: a line is written completely or not at all, whatever the disk does."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from glshadow.errors import GlshadowError, SettingsError
from glshadow.journal import Journal


class Full(io.FileIO):
    """A file on a disk with only a few bytes left."""

    free = 10

    def write(self, data: bytes) -> int:  # type: ignore[override]
        if self.free == 0:
            raise OSError(28, "No space left on device")
        taken = super().write(data[: self.free])
        self.free -= taken
        return taken


def test_full_disk_leaves_no_partial_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "j.jsonl"
    journal = Journal(path)
    journal.add({"key": "a", "value": 1})
    before = path.read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", lambda self, mode, buffering=-1: Full(self, "ab"))
        with pytest.raises(GlshadowError, match=r"cannot write .*j\.jsonl: No space left on device"):
            journal.add({"key": "b", "value": 2})
    assert path.read_bytes() == before
    assert set(journal.records) == {"a"}, "the failed record is absent"
    journal.add({"key": "c", "value": 3})
    assert set(Journal(path).records) == {"a", "c"}


def test_partial_writes_are_continued(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Slow(Full):
        free = 1 << 20

        def write(self, data: bytes) -> int:  # type: ignore[override]
            return super().write(bytes(data)[:3])

    path = tmp_path / "j.jsonl"
    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", lambda self, mode, buffering=-1: Slow(self, "ab"))
        Journal(path).add({"key": "a", "value": 1})
    assert Journal(path).records == {"a": {"key": "a", "value": 1}}


def test_truncated_line_is_dropped(tmp_path: Path) -> None:
    path = tmp_path / "j.jsonl"
    path.write_text('{"key":"a"}\n{"key":"b')
    assert set(Journal(path).records) == {"a"}
    assert path.read_text() == '{"key":"a"}\n'


@pytest.mark.parametrize("target", ["elsewhere.txt", "gone.txt", "folder"])
def test_link_is_refused(tmp_path: Path, target: str) -> None:
    """Lines would be appended to whatever file it leads to."""
    (tmp_path / "elsewhere.txt").write_text("")
    (tmp_path / "folder").mkdir()
    (tmp_path / "j.jsonl").symlink_to(tmp_path / target)
    with pytest.raises(SettingsError, match=r"j\.jsonl is a link, where a journal must be a file"):
        Journal(tmp_path / "j.jsonl")
    assert not (tmp_path / "gone.txt").exists()
