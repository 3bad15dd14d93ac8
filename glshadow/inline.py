"""Images in HTML, for notebooks and reports: file bytes, data URLs, figures."""

from __future__ import annotations

import base64
import io
import sys
from collections.abc import Callable
from html import escape
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.errors import GlshadowError, printable

NOTEBOOK_LEVEL, PAGE_LEVEL = 1, 9  # zlib levels: fast for a notebook cell, small for a page that is kept
JPEG_QUALITY = 88
SKY = (222, 232, 242)  # colour of pixels without a surface


def png(image: NDArray[np.uint8], level: int = NOTEBOOK_LEVEL) -> bytes:
    """An image (H, W, 3) as the bytes of a PNG file, equal for equal pixels."""
    from PIL import Image

    data = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(image)).save(data, format="png", compress_level=level)
    return data.getvalue()


def jpeg(image: NDArray[np.uint8]) -> bytes:
    """An image (H, W, 3) as the bytes of a JPEG file."""
    from PIL import Image

    data = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(image)).save(data, format="jpeg", quality=JPEG_QUALITY, subsampling=0)
    return data.getvalue()


def address(data: bytes) -> str:
    """The bytes of a PNG or JPEG file as a `data:` URL."""
    kind = "jpeg" if data.startswith(b"\xff\xd8") else "png"
    return f"data:image/{kind};base64,{base64.b64encode(data).decode()}"


def words(text: str) -> str:
    """Text escaped for HTML."""
    return escape(printable(text))


def figure(image: NDArray[np.uint8], caption: str) -> str:
    """An HTML figure of an image (H, W, 3) with its caption, for a notebook's cell."""
    return (
        f'<figure style="margin:0 0 .8em"><img src="{address(png(image))}" alt="{words(caption)}" '
        f'style="max-width:100%"><figcaption>{words(caption)}</figcaption></figure>'
    )


def table(head: list[str], rows: list[list[str]]) -> str:
    """An HTML table of text and numbers, for a notebook's cell."""
    cells = "".join(f"<th>{words(word)}</th>" for word in head)
    body = "".join("<tr>" + "".join(f"<td>{words(word)}</td>" for word in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>"


def visibility_picture(visibility: ArrayLike, cosine: ArrayLike = 1.0) -> NDArray[np.uint8]:
    """One light's visibility as an image: lit surfaces light grey, others dark.

    Parameters
    ----------
    visibility : (H, W) array_like
        1 lit, 0 dark, NaN where there is no surface.
    cosine : (H, W) array_like
        N.L, which makes shapes visible; every lit pixel stays brighter than every dark one.

    Returns
    -------
    (H, W, 3) uint8
    """
    lit = np.asarray(visibility, dtype=np.float64)
    seen = np.isfinite(lit)
    slope = np.clip(np.nan_to_num(np.asarray(cosine, dtype=np.float64)), 0.0, 1.0)
    grey = np.rint((40.0 + 195.0 * np.where(seen, lit, 0.0)) * (0.5 + 0.5 * slope)).astype(np.uint8)
    return np.where(seen[..., None], grey[..., None], np.array(SKY, dtype=np.uint8))


class NotebookBar:
    """A progress bar below the running cell, from the first report until it is closed. Called as (done, total, text)."""

    def __init__(self, widgets: Any, display: Callable[[Any], None]) -> None:
        self._bar, self._words = widgets.IntProgress(), widgets.HTML()
        self._box, self._display = widgets.HBox([self._bar, self._words]), display
        self._shown = False

    def __call__(self, done: int, total: int, text: str) -> None:
        if not self._shown:
            self._display(self._box)
            self._shown = True
        self._bar.max, self._bar.value = max(total, 1), done
        self._words.value = words(f"{done} of {total}: {text}")

    def close(self) -> None:
        """Remove the bar."""
        self._box.close()


def notebook_bar() -> NotebookBar | None:
    """A progress bar if this runs in a notebook with ipywidgets; None elsewhere."""
    interactive = sys.modules.get("IPython")  # not imported: then this is not a notebook
    shell = interactive.get_ipython() if interactive else None
    if shell is None or not hasattr(shell, "kernel"):
        return None
    try:
        import ipywidgets
        from IPython.display import display
    except ImportError:
        return None
    return NotebookBar(ipywidgets, display)


def show(image: NDArray[np.uint8]) -> None:
    """Show an image (H, W, 3 or 4) in a notebook's cell, or else in the system's image viewer; GlshadowError if there is no viewer."""
    from PIL import Image, ImageShow

    picture = Image.fromarray(np.ascontiguousarray(image))
    interactive = sys.modules.get("IPython")
    shell = interactive.get_ipython() if interactive else None
    if shell is not None and hasattr(shell, "kernel"):
        from IPython.display import display

        display(picture)  # type: ignore[no-untyped-call]
    elif not ImageShow.show(picture):
        raise GlshadowError("no image viewer was found on this machine: save the frame and open the file")
