"""Failed runs as pages of the web console: one file each, to be looked at without Ruedo."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..launching import find_ruedo
from ..terminal import tell
from .local import Crew
from .plan import Case

_MOST_MB = 5  # of a page


def make_pages(
    campaign: Any, failed: Iterable[tuple[Case, dict[str, Any]]], folder: Path
) -> dict[str, Path]:
    """By the case's id. What was kept of a run has no messages, so the run is repeated; a page that
    is there stays. A case without one is named on the standard error stream.
    """
    pages = {}
    for case, row in failed:
        page = folder / f"{case.id}.html"
        fault = "" if page.exists() else _make_page(campaign, case, row, page)
        if fault:
            tell(f"ruedo: no page of case {case.number}: {fault}")
        else:
            pages[case.id] = page
    return pages


def _make_page(campaign: Any, case: Case, row: dict[str, Any], page: Path) -> str:
    """Writes the page of a failed run. Returns "", or why it could not."""
    with tempfile.TemporaryDirectory(prefix="ruedo-page-") as scratch:
        log = Path(scratch) / "run.lcm"
        with Crew(str(campaign.folder)) as crew:
            outcome = crew.run_one(case.what, full_log=str(log))
        if not log.exists():
            return outcome.reason or "it left no log"
        if outcome.status != row["status"]:
            return f"it was {row['status']}, and repeated it is {outcome.status}"
        page.parent.mkdir(parents=True, exist_ok=True)
        command = [find_ruedo(), "play", str(log), "--html", str(page), "--html-size"]
        done = subprocess.run(
            [*command, str(_MOST_MB)], capture_output=True, text=True, check=False
        )
        lines = done.stderr.strip().splitlines()
        return (lines[-1] if lines else "ruedo play failed") if done.returncode else ""
