"""The glTF container: JSON, binary chunk, buffers and external files, checked before use."""

from __future__ import annotations

import base64
import os
import re
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from numpy.typing import NDArray

from glshadow.core.strict_json import strict_json
from glshadow.errors import SceneError
from glshadow.files import inside
from glshadow.io.gltf import meshopt
from glshadow.io.gltf.features import can_be_required, notes_on
from glshadow.io.limits import Budget
from glshadow.io.mesh_files.words import without_mark
from glshadow.io.model_file import ModelFile, model_file

JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
HEAD = 12  # bytes before the first chunk
MOST_CHUNKS = 1000  # that are searched; the binary chunk is the second
SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")

DRACO = "KHR_draco_mesh_compression"  # needs DracoPy; refused on use without it
ADVICE = {
    **dict.fromkeys(
        meshopt.NAMES,
        "`pip install 'glshadow[gltf]'`, or decompress it first, for example with `gltf-transform copy in.glb out.glb`",
    ),
    "KHR_draco_mesh_compression": "`pip install DracoPy`, or decompress it first, for example with `gltf-transform "
    "copy in.glb out.glb`",
}


@dataclass
class Document:
    """Parsed glTF with lazily read buffers.

    Parameters
    ----------
    json : dict
        The top level object.
    folder : Path, optional
        Folder of the file; nothing outside it is opened. None, for data in memory: nothing at all.
    binary : bytes, optional
        The BIN chunk.
    budget : Budget
        Remaining budget of the file.
    notes : list of str
        What was ignored or replaced.
    buffers, views, arrays, files : dict
        Caches: bytes of buffers and of compressed buffer views and values of accessors by index, bytes of files by path and length.
    """

    json: dict[str, Any]
    folder: Path | None
    binary: memoryview | None = None
    budget: Budget = field(default_factory=Budget)
    notes: list[str] = field(default_factory=list)
    buffers: dict[int, memoryview] = field(default_factory=dict)
    views: dict[int, memoryview] = field(default_factory=dict)
    arrays: dict[int, NDArray[Any]] = field(default_factory=dict)
    files: dict[tuple[Path, int | None], bytes] = field(default_factory=dict)

    def items(self, kind: str) -> list[Any]:
        """The top-level array `kind`, empty if absent."""
        value = self.json.get(kind, [])
        if not isinstance(value, list):
            raise SceneError(f"not valid glTF: {kind!r} must be an array, got {type(value).__name__}")
        return value

    def item(self, kind: str, index: Any, user: str) -> dict[str, Any]:
        """Element `index` of the top-level array `kind`, which `user` refers to."""
        items = self.items(kind)
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(items):
            raise SceneError(f"{user} refers to {kind}[{index!r}], but the file has {len(items)} {kind}")
        return as_object(items[index], f"{kind}[{index}]")

    def buffer(self, index: Any, user: str) -> memoryview:
        """Bytes of a buffer, exactly its byteLength."""
        buffer = self.item("buffers", index, user)
        if index not in self.buffers:
            length = count(buffer, "byteLength", f"buffers[{index}]", least=1)
            data = self._buffer_bytes(buffer, index, length)
            if len(data) < length:
                raise SceneError(
                    f"buffers[{index}] declares {length} bytes, but only {len(data)} are there: the file is cut off "
                    "or broken"
                )
            self.buffers[index] = data[:length]
        return self.buffers[index]

    def _buffer_bytes(self, buffer: dict[str, Any], index: int, length: int) -> memoryview:
        if "uri" in buffer:
            return memoryview(self.resource(buffer["uri"], f"buffers[{index}]", length))
        if index == 0 and self.binary is not None:
            return self.binary
        for name in meshopt.NAMES:
            if name in extensions(buffer):
                raise refused(name)
        raise SceneError(f"buffers[{index}] has neither an uri nor a binary chunk: there is no data to read")

    def view(self, index: Any, user: str) -> tuple[memoryview, int]:
        """Bytes of a buffer view and its byteStride (0: packed)."""
        where = f"bufferViews[{index}]"
        view = self.item("bufferViews", index, user)
        name = next((each for each in meshopt.NAMES if each in extensions(view)), None)
        if name is not None and not self._has_data(view.get("buffer"), where):
            return self._decompressed(index, view, name, where), count(view, "byteStride", where, default=0)
        data = self.buffer(view.get("buffer"), where)
        offset, length = count(view, "byteOffset", where, default=0), count(view, "byteLength", where, least=1)
        if offset + length > len(data):
            raise SceneError(f"{where} covers bytes {offset} to {offset + length}, but its buffer has {len(data)}")
        return data[offset : offset + length], count(view, "byteStride", where, default=0)

    def _has_data(self, index: Any, user: str) -> bool:
        """Whether a buffer has bytes of its own, next to its compressed form."""
        return "uri" in self.item("buffers", index, user) or (index == 0 and self.binary is not None)

    def _decompressed(self, index: int, view: dict[str, Any], name: str, where: str) -> memoryview:
        """Bytes of a compressed buffer view."""
        if index not in self.views:
            if not meshopt.is_installed():
                raise refused(name)
            block = as_object(extensions(view)[name], f"{where}.{name}")
            offset, length = count(block, "byteOffset", where, default=0), count(block, "byteLength", where, least=1)
            number, stride = count(block, "count", where, least=1), count(block, "byteStride", where, least=1)
            data = self.buffer(block.get("buffer"), where)
            if offset + length > len(data):
                raise SceneError(f"{where} covers bytes {offset} to {offset + length}, but its buffer has {len(data)}")
            if number * stride != count(view, "byteLength", where, least=1):
                raise SceneError(f"{where}: {number} elements of {stride} bytes are not its {view['byteLength']} bytes")
            mode, kind = block.get("mode"), block.get("filter", "NONE")
            self.views[index] = meshopt.decompressed(
                data[offset : offset + length], number, stride, mode, kind, self.budget, where
            )
        return self.views[index]

    def path(self, uri: Any, user: str) -> Path:
        """The file next to the model that `uri` names.

        Raises
        ------
        SceneError
            If it is not a relative path inside the model's folder, if a link leads out of it, or if the file does not exist.
        """
        if not isinstance(uri, str) or not uri:
            raise SceneError(f"{user}: an uri must be a text, got {uri!r}")
        name = unquote(uri).replace("\\", "/")
        local = os.path.normpath(name)
        if SCHEME.match(uri) or name.startswith("/") or Path(local).parts[:1] == (os.pardir,) or "\0" in name:
            raise SceneError(
                f"{user}: the uri {uri[:80]!r} leaves the model's folder; only files in it (or below) and data: are "
                "read"
            )
        if self.folder is None:
            raise SceneError(
                f"{user}: it names the file {name!r}, and data in memory has no folder: load it by its path, or as .glb"
            )
        path = self.folder / local
        self.budget.files.add(path)
        if not inside(path, self.folder):
            raise SceneError(f"{user}: the file {name!r} is a link out of the model's folder, which is not followed")
        if not path.is_file():
            raise SceneError(
                f"{user}: the file {name!r} is missing; it is expected next to the model, in {self.folder}"
            )
        return path

    def resource(self, uri: Any, user: str, most: int | None = None) -> bytes:
        """Bytes of a data: uri or of a file next to the model; of a longer file the first `most`."""
        if not (isinstance(uri, str) and uri.startswith("data:")):
            path = self.path(uri, user)
            if (path, most) not in self.files:
                self.files[path, most] = self.budget.read(path, user, most)
            return self.files[path, most]
        head, comma, body = uri.partition(",")
        if not comma or not head.endswith(";base64"):
            raise SceneError(f"{user}: a data: uri must be base64, got {uri[:40]!r}")
        try:
            return base64.b64decode(body, validate=True)
        except ValueError as error:  # of binascii, or for letters beyond ASCII
            raise SceneError(f"{user}: its data: uri is not valid base64 ({error})") from error


def as_object(value: Any, name: str) -> dict[str, Any]:
    """`value` if it is a JSON object."""
    if not isinstance(value, dict):
        raise SceneError(f"not valid glTF: {name} must be an object, got {type(value).__name__}")
    return value


def extensions(owner: dict[str, Any]) -> dict[str, Any]:
    """The extensions object of `owner`, empty if absent."""
    return as_object(owner.get("extensions", {}), "extensions")


def count(owner: dict[str, Any], key: str, name: str, *, default: int | None = None, least: int = 0) -> int:
    """An integer of at least `least`; `default` if it is absent."""
    value = owner.get(key, default)
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise SceneError(f"not valid glTF: {name}.{key} must be an integer of at least {least}, got {value!r}")
    return value


def refused(name: str) -> SceneError:
    """The error for an extension that would need decoding."""
    advice = ADVICE.get(name, "save the model without it")
    return SceneError(f"it needs the glTF extension {name}, which is not supported: {advice}")


def open_document(source: Path | ModelFile, budget: Budget) -> Document:
    """Parse a .glb or .gltf file; its size is added to the budget's read bytes.

    Raises
    ------
    SceneError
        If the container is truncated, it is not JSON, not glTF 2, or requires an unsupported extension.
    """
    file = model_file(source)
    size, head = file.size, file.head(HEAD)
    binary, notes, used = None, [], dict[str, None]()
    if head[:4] == b"glTF" or file.suffix == ".glb":
        length = _check_head(head, size)
        if length < size:
            notes.append(f"{size - length} byte(s) behind the {length} that its header declares are ignored")
        text, binary = _chunks(file.read(budget, length))
    else:
        text = file.read(budget)
    document = Document(as_object(_parsed(text, used), "the top level"), file.folder, binary, budget, notes)
    version = as_object(document.json.get("asset", {}), "asset").get("version", "2.0")
    if not str(version).startswith("2"):
        raise SceneError(f"it is glTF {version!r}; only glTF 2 is read, convert it first")
    for name in document.items("extensionsRequired"):
        if not can_be_required(str(name)):
            raise refused(str(name))
    notes += notes_on(used)
    if len(document.items("scenes")) > 1:
        notes.append(f"it has {len(document.items('scenes'))} scenes: the default one is drawn")
    return document


def _parsed(text: bytes, used: dict[str, None]) -> Any:
    """JSON with or without a byte order mark; `used` gets the names of the extensions in it."""

    def note(found: dict[str, Any]) -> None:
        if isinstance(found.get("extensions"), dict):
            used.update(dict.fromkeys(found["extensions"]))

    try:
        return strict_json(without_mark(text).decode("utf-8"), note)
    except UnicodeDecodeError as error:
        raise SceneError(f"not valid glTF: its JSON is not UTF-8 (byte {error.start})") from error
    except ValueError as error:
        raise SceneError(f"not valid glTF: its JSON cannot be read ({error})") from error


def _check_head(head: bytes, size: int) -> int:
    """Refuse a file that is not a GLB container before it is read completely; returns the declared length."""
    if size == 0:
        raise SceneError("the file is empty")
    if size < 20 or head[:4] != b"glTF":
        raise SceneError(
            f"not a GLB file: it begins with {head[:4]!r} and has {size} bytes; b'glTF' and at least 20 are needed"
        )
    version, length = struct.unpack_from("<II", head, 4)
    if version != 2:
        raise SceneError(f"it is GLB version {version}; only version 2 is read, convert it first")
    if length > size or length < HEAD + 8:
        raise SceneError(
            f"broken GLB: its header declares {length} bytes, the file has {size}; export or download it again"
        )
    return int(length)


def _chunks(data: bytes) -> tuple[bytes, memoryview | None]:
    """JSON text and binary chunk of a GLB container: its first chunk, and the first chunk of the binary kind."""
    text, at = None, HEAD
    for _ in range(MOST_CHUNKS):
        if at + 8 > len(data):
            break
        size, kind = struct.unpack_from("<II", data, at)
        if at + 8 + size > len(data):
            raise SceneError(
                f"broken GLB: a chunk of {size} bytes begins at byte {at + 8}, but the file ends at {len(data)}; export "
                "or download it again"
            )
        chunk = memoryview(data)[at + 8 : at + 8 + size]
        if text is None:
            if kind != JSON_CHUNK:
                break
            text = bytes(chunk)
        elif kind == BINARY_CHUNK:
            return text, chunk
        at += 8 + size
    if text is None:
        raise SceneError("broken GLB: its first chunk is not JSON")
    return text, None
