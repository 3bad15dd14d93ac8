"""Run lengths of masks as COCO has them: down the columns, unlit first; as numbers or as text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from glshadow.core.spaces import Bools

_BITS, _SIGN, _MORE, _FIRST = 5, 16, 32, 48


def run_lengths(mask: Bools) -> list[int]:
    """Lengths of the runs of a mask (H, W) down its columns, the first of pixels that are False; it may be 0.

    References
    ----------
    Lin et al. 2014, "Microsoft COCO: Common objects in context", ECCV; the format of its annotations.
    """
    flat = mask.ravel(order="F")
    borders = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    lengths = np.diff(np.concatenate([[0], borders, [len(flat)]])).tolist()
    return [0, *lengths] if len(flat) and flat[0] else lengths


def mask_of(lengths: Sequence[int], size: tuple[int, int]) -> Bools:
    """The mask (H, W) of run lengths; size is (height, width)."""
    inside = np.arange(len(lengths)) % 2 == 1
    return np.repeat(inside, lengths).reshape(size, order="F")


def as_text(lengths: Sequence[int]) -> str:
    """Run lengths as text: from the fourth on their difference to the one before the last, five bits in a character, lowest first.

    The format of COCO's `counts`, which pycocotools reads.
    """
    text = []
    for k, length in enumerate(lengths):
        rest = length - lengths[k - 2] if k > 2 else length
        while True:
            bits, rest = rest & 31, rest >> _BITS
            more = rest != (-1 if bits & _SIGN else 0)
            text.append(chr(_FIRST + bits + _MORE * more))
            if not more:
                break
    return "".join(text)


def from_text(text: str) -> list[int]:
    """The run lengths of a text."""
    lengths: list[int] = []
    value = shift = 0
    for character in text:
        bits = ord(character) - _FIRST
        value |= (bits & 31) << shift
        shift += _BITS
        if not bits & _MORE:
            if bits & _SIGN:
                value -= 1 << shift
            lengths.append(value + lengths[-2] if len(lengths) > 2 else value)
            value = shift = 0
    return lengths
