"""How far a campaign is, on a terminal: rate, failures, and the time that is left."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from .plan import shard_of


@contextmanager
def shown(campaign: Any, shard: str | None, quiet: bool) -> Iterator[Callable[..., None] | None]:
    """Yields a function to call with each outcome; None without a terminal."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    try:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )
    except ImportError:
        yield None
        return
    cases = shard_of(campaign.cases, shard) if shard else campaign.cases
    before = len(campaign.results(shard).done)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TextColumn("[red]{task.fields[failed]} failed"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task(campaign.name, total=len(cases) - before, failed=0, rate="")

        def progress(case: Any, outcome: dict[str, Any]) -> None:
            one = bar.tasks[0]
            bar.update(
                task,
                advance=1,
                failed=one.fields["failed"] + (outcome["status"] != "passed"),
                rate=f"{one.speed:.1f}/s" if one.speed else "",
            )

        yield progress
