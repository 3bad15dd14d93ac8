"""The system libraries that the installed wheels need: reports missing ones, and libraries that set-up does not know.

    libraries.py            prints the Debian packages of the missing ones: what set-up installs
    libraries.py --check    fails with a message if a wheel needs a library that is missing, or that PACKAGES does not list

Reads every shared object of the running interpreter's packages; libraries that a wheel contains itself are not looked up in the system.
"""

import ctypes
import mmap
import struct
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path

PACKAGES = {  # library -> its Debian package
    "libatomic.so.1": "libatomic1",
    "libexpat.so.1": "libexpat1",
    "libgcc_s.so.1": "libgcc-s1",
    "libstdc++.so.6": "libstdc++6",
    "libz.so.1": "zlib1g",
}
# Files that a wheel does not need if their libraries are missing: numba's optional threading layers.
OPTIONAL = ("omppool.", "tbbpool.")
# Parts of the C library, without which there is no Python.
GLIBC = ("ld-linux", "libc.so", "libdl.so", "libm.so", "libmvec.so", "libpthread.so", "librt.so", "libutil.so")

_LOAD, _DYNAMIC = 1, 2
_NEEDED, _STRING_TABLE = 1, 5


def needed(path: Path) -> list[str]:
    """Names of the libraries that a shared object needs; empty unless it is a 64-bit little-endian ELF file."""
    with path.open("rb") as file:
        if file.read(6) != b"\x7fELF\x02\x01":
            return []
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            (headers,) = struct.unpack_from("<Q", data, 32)
            size, count = struct.unpack_from("<HH", data, 54)
            # type, flags, offset, address, -, size in the file
            segments = [struct.unpack_from("<IIQQQQ", data, headers + i * size) for i in range(count)]
            entries = [entry for segment in segments if segment[0] == _DYNAMIC for entry in _entries(data, segment)]
            table = next((value for tag, value in entries if tag == _STRING_TABLE), 0)
            strings = next(
                (table - address + offset for kind, _, offset, address, _, length in segments
                 if kind == _LOAD and address <= table < address + length), 0)  # fmt: skip
            names = [strings + value for tag, value in entries if tag == _NEEDED]
            return [data[start : data.find(b"\0", start)].decode() for start in names]


def _entries(data: mmap.mmap, segment: tuple[int, ...]) -> Iterator[tuple[int, int]]:
    for start in range(segment[2], segment[2] + segment[5], 16):
        tag, value = struct.unpack_from("<QQ", data, start)
        if tag == 0:
            return
        yield tag, value


def system_libraries(folder: Path) -> dict[str, Path]:
    """Library -> one of the files below the folder that needs it, without libraries below the folder itself."""
    objects = [path for path in sorted(folder.rglob("*.so*")) if path.is_file() and not path.name.startswith(OPTIONAL)]
    brought = {path.name for path in objects}
    needed_by: dict[str, Path] = {}
    for path in objects:
        for name in needed(path):
            if name not in brought and not name.startswith(GLIBC):
                needed_by.setdefault(name, path.relative_to(folder))
    return needed_by


def loads(name: str) -> bool:
    """Whether the system has a library and all its dependencies."""
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


def main(check: bool) -> int:
    """Check, or print the missing packages; returns the exit code."""
    needed_by = system_libraries(Path(sysconfig.get_path("platlib")))
    missing = sorted(name for name in needed_by if not loads(name))
    if not check:
        sys.stdout.writelines(f"{PACKAGES[name]}\n" for name in missing if name in PACKAGES)
        return 0
    unknown = sorted(needed_by.keys() - PACKAGES.keys())
    for name in missing:
        sys.stderr.write(
            f"{name}, which {needed_by[name]} needs, is missing: apt-get install {PACKAGES.get(name, '?')}\n"
        )
    for name in unknown:
        sys.stderr.write(f"{name}, which {needed_by[name]} needs, has no package in PACKAGES of scripts/libraries.py\n")
    return int(bool(missing or unknown))


if __name__ == "__main__":
    sys.exit(main("--check" in sys.argv[1:]))
