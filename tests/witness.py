"""Whether the machine, not the program under test, was at fault: the only ground on which a test
begins anew. tests/witness.h is its twin.
"""

from __future__ import annotations

import os
import re
import threading
import time
from collections.abc import Iterator
from pathlib import Path

_HEADER = Path(__file__).with_name("witness.h").read_text(encoding="utf-8")
HELD_UP_SECONDS = float(re.search(r"kHeldUp_s = ([0-9.]+);", _HEADER).group(1))
_NAP_SECONDS = 0.01
_MOST_ATTEMPTS = 4


class Witness:
    """A thread that sleeps: where it wakes late, all of the machine's programs were held up."""

    def __init__(self) -> None:
        self._longest = 0.0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def _watch(self) -> None:
        while not self._over.is_set():
            before = time.monotonic()
            time.sleep(_NAP_SECONDS)
            self._longest = max(self._longest, time.monotonic() - before - _NAP_SECONDS)

    def close(self) -> None:
        self._over.set()
        self._thread.join()

    def excuses(self) -> bool:
        """Each such excuse is counted: a run of all tests has at most three (scripts/test)."""
        if self._longest <= HELD_UP_SECONDS:
            return False
        test = os.environ.get("PYTEST_CURRENT_TEST", "?").split(" ")[0]
        print(f"begins anew: all programs were held up for {self._longest:.2f} s ({test})")
        if file := os.environ.get("RUEDO_REPEATS"):
            with open(file, "a", encoding="utf-8") as repeats:
                repeats.write(test + "\n")
        return True


def attempts() -> Iterator[Witness]:
    """for witness in attempts(): ...; if good or not witness.excuses(): break."""
    for _ in range(_MOST_ATTEMPTS):
        witness = Witness()
        try:
            yield witness
        finally:
            witness.close()
