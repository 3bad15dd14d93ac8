"""Drops a file on a window as a file manager does: the X drag-and-drop protocol, version 5 (freedesktop.org, XDND)."""

from __future__ import annotations

import time
from pathlib import Path

from Xlib import X, Xatom, display
from Xlib.protocol import event

from ..tolerances import PATIENCE_S


def dropped(name: str, path: Path, title: str) -> None:
    """Drop a file on the middle of the window of that title on a display.

    Raises
    ------
    RuntimeError
        If there is no such window, or it does not take the file.
    """
    screen = display.Display(name)
    try:
        _drop(screen, path, title)
    finally:
        screen.close()


def _drop(screen: display.Display, path: Path, title: str) -> None:
    atom = {
        each: screen.intern_atom(each)
        for each in (
            "XdndAware", "XdndEnter", "XdndPosition", "XdndStatus", "XdndDrop", "XdndFinished", "XdndSelection", "XdndActionCopy",
            "text/uri-list",
        )
    }  # fmt: skip
    root = screen.screen().root
    window = next((each for each in root.query_tree().children if each.get_wm_name() == title), None)
    if window is None or window.get_full_property(atom["XdndAware"], Xatom.ATOM) is None:
        raise RuntimeError(f"no window {title!r} that takes files")
    source = root.create_window(0, 0, 1, 1, 0, X.CopyFromParent, event_mask=X.PropertyChangeMask)
    source.set_selection_owner(atom["XdndSelection"], X.CurrentTime)

    def tell(kind: str, *data: int) -> None:
        words = (32, [source.id, *data, *[0] * (4 - len(data))])
        window.send_event(event.ClientMessage(window=window, client_type=atom[kind], data=words), event_mask=0)
        screen.flush()

    place = window.get_geometry()
    x, y = place.x + place.width // 2, place.y + place.height // 2
    tell("XdndEnter", 5 << 24, atom["text/uri-list"])
    tell("XdndPosition", 0, x << 16 | y, X.CurrentTime, atom["XdndActionCopy"])
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        if not screen.pending_events():
            time.sleep(0.02)
            continue
        heard = screen.next_event()
        if heard.type == X.SelectionRequest:
            heard.requestor.change_property(heard.property, atom["text/uri-list"], 8, f"{path.as_uri()}\r\n".encode())
            heard.requestor.send_event(
                event.SelectionNotify(
                    time=heard.time, requestor=heard.requestor, selection=heard.selection, target=heard.target, property=heard.property
                )
            )  # fmt: skip
            screen.flush()
        elif heard.type == X.ClientMessage and heard.client_type == atom["XdndStatus"]:
            if not heard.data[1][1] & 1:
                raise RuntimeError("the window does not take the file")
            tell("XdndDrop", 0, X.CurrentTime)
        elif heard.type == X.ClientMessage and heard.client_type == atom["XdndFinished"]:
            return
    raise RuntimeError("the window never said that it has the file")
