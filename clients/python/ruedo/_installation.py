"""Libraries that Ruedo's wheel adds for LCM's: a bare Debian has no GLib, which LCM's compiled part
is linked to.
"""

from __future__ import annotations

import ctypes

_GLIB = "libglib-2.0.so.0"


def load_glib() -> None:
    """The machine's own where there is one, so that a program never has two."""
    try:
        ctypes.CDLL(_GLIB)
    except OSError:
        from pathlib import Path

        for file in (Path(__file__).resolve().parent / "lib").glob(f"**/{_GLIB}"):
            ctypes.CDLL(str(file))
