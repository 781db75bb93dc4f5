"""Results in SQLite, as they come: one row a case, by the hash of all that acts on it."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import re
import shutil
import sqlite3
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from ..files import open_regular, read_bytes
from .errors import CampaignError, ResultsError, missing
from .plan import COLUMNS, Case

_TABLES = {
    "about": "(key TEXT PRIMARY KEY, value TEXT NOT NULL)",
    "results": """(
  id TEXT PRIMARY KEY, status TEXT NOT NULL, what TEXT NOT NULL, reason TEXT NOT NULL, time_s REAL NOT NULL,
  state_hash TEXT NOT NULL, metrics TEXT NOT NULL, track TEXT NOT NULL, output TEXT NOT NULL, wall_s REAL NOT NULL)""",
}
_COLUMNS = (
    "id",
    "status",
    "what",
    "reason",
    "time_s",
    "state_hash",
    "metrics",
    "track",
    "output",
    "wall_s",
)
_TEXTS = ("what", "reason", "state_hash", "output")
_FORMAT = "1"
_ALL = f"SELECT {', '.join(_COLUMNS)} FROM results"
_STATUSES = ("passed", "failed", "not judged", "crashed", "timeout", "memory", "invalid")
_MOST_LOG_BYTES = 1 << 30


class Store:
    """The folder of a campaign's results: results.sqlite, logs/, worlds/. One writer at a time.

    write=False: only read, and maybe somebody else's, of which nothing is believed. Raises
    CampaignError for what cannot be opened, and ResultsError, here and later, for what is damaged.
    """

    def __init__(self, folder: Path, write: bool = True) -> None:
        self.folder = folder
        self._file = folder / "results.sqlite"
        if not write and not self._file.is_file():
            raise ResultsError(f"{folder} holds no results of a campaign (no results.sqlite)")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            # Not opened here: to close it would end SQLite's locks of this whole process.
            if self._file.exists() and not self._file.is_file():
                raise OSError("it is not a regular file")
            self._copy = None if write or os.access(folder, os.W_OK) else _copy_of(self._file)
            file = Path(self._copy.name) / self._file.name if self._copy else self._file
            self._db = sqlite3.connect(file, timeout=10, isolation_level=None)
            self._check_tables()
            self._db.executescript("PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL;")
            for name, columns in _TABLES.items():
                self._db.execute(f"CREATE TABLE IF NOT EXISTS {name} {columns}")
        except OSError as error:
            raise CampaignError(f"{self._file}: {error}") from None
        except sqlite3.Error as error:
            raise self._fault(error) from None
        found = self.about("format")
        if found is None:
            self.set_about("format", _FORMAT)
        elif found != _FORMAT:
            raise ResultsError(f"{self._file} is of format {found!r}; this Ruedo reads {_FORMAT}")

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self._db.close()
        if self._copy:
            self._copy.cleanup()

    def _damaged(self, what: str) -> ResultsError:
        return ResultsError(f"{self._file} is damaged, or no campaign's: {what}")

    def _fault(self, error: sqlite3.Error) -> CampaignError:
        if isinstance(error, sqlite3.OperationalError):  # no room, no permission
            return CampaignError(f"{self._file}: {error}")
        return self._damaged(str(error))

    def _check_tables(self) -> None:
        """A view, a trigger or a computed column would run what its maker wrote."""
        for name, sql in self._select("SELECT name, sql FROM sqlite_master WHERE sql NOTNULL"):
            if sql != f"CREATE TABLE {name} {_TABLES.get(name)}":
                raise self._damaged(f"it has a {name!r} of another kind")

    def _select(self, statement: str, values: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
        try:
            yield from self._db.execute(statement, values)
        except sqlite3.Error as error:
            raise self._fault(error) from None

    def about(self, key: str) -> str | None:
        for (value,) in self._select("SELECT value FROM about WHERE key = ?", (key,)):
            return str(value)
        return None

    def set_about(self, key: str, value: str) -> None:
        self._write("INSERT OR REPLACE INTO about VALUES (?, ?)", (key, value))

    def known(self) -> set[str]:
        """The ids of all cases that have a result."""
        return {row[0] for row in self._select("SELECT id FROM results")}

    def add(self, id: str, outcome: dict[str, Any], wall_s: float, keep_log: bool) -> None:
        """On the disk when this returns. Raises CampaignError for a full one; nothing that was
        there is lost.
        """
        if keep_log and outcome["log"]:
            self._keep_log(id, outcome["log"])
        self._write(
            f"INSERT OR REPLACE INTO results VALUES ({', '.join('?' * len(_COLUMNS))})",
            (
                id,
                outcome["status"],
                outcome["what"],
                outcome["reason"],
                outcome["time_s"],
                outcome["state_hash"],
                json.dumps(outcome["metrics"], sort_keys=True),
                json.dumps(outcome["track"]),
                outcome["output"] if outcome["status"] != "passed" else "",
                wall_s,
            ),
        )

    def rows(self, ids: Iterable[str]) -> dict[str, dict[str, Any]]:
        """The results of the given cases that have one."""
        wanted = set(ids)
        found = {}
        for row in self._select(_ALL):
            if row[0] in wanted:
                found[row[0]] = self._checked(row)
        return found

    def each(self) -> Iterator[tuple[Any, ...]]:
        """All results as stored, each checked; the id comes first."""
        for row in self._select(_ALL):
            self._checked(row)
            yield row

    def _checked(self, row: tuple[Any, ...]) -> dict[str, Any]:
        """A row's columns, of the kinds that were written."""
        one = dict(zip(_COLUMNS, row))
        try:
            one["metrics"], one["track"] = json.loads(one["metrics"]), json.loads(one["track"])
            good = (
                re.fullmatch("[0-9a-f]{16}", one["id"]) is not None
                and one["status"] in _STATUSES
                and all(isinstance(one[name], str) for name in _TEXTS)
                and all(isinstance(one[name], (int, float)) for name in ("time_s", "wall_s"))
                and isinstance(one["metrics"], dict)
                and all(
                    name.encode() and isinstance(value, (int, float)) and _fits(value)
                    for name, value in one["metrics"].items()
                )
                and all(
                    len(place) == 3
                    and all(isinstance(x, (int, float)) and math.isfinite(x) for x in place)
                    for place in one["track"]
                )
            )
        except (TypeError, ValueError, OverflowError, RecursionError):
            good = False
        if not good:
            raise self._damaged(f"the result {row[0]!r:.40} is not valid")
        return one

    def take(self, other: Store) -> int:
        """The results and logs of another folder that are not here yet; how many."""
        known = self.known()
        taken = 0
        for row in other.each():
            if row[0] in known:
                continue
            self._write(f"INSERT INTO results VALUES ({', '.join('?' * len(_COLUMNS))})", row)
            log = other.log(row[0])
            if log.exists():
                try:
                    content = read_bytes(log, _MOST_LOG_BYTES)
                except OSError as error:
                    raise ResultsError(f"{log}: {error}") from None
                self._keep_log(row[0], content)
            taken += 1
        return taken

    def log(self, id: str) -> Path:
        """The path of a case's log, if it was kept."""
        return _log_of(self.folder, id)

    def _keep_log(self, id: str, content: bytes) -> None:
        try:
            self.log(id).parent.mkdir(exist_ok=True)
            part = self.log(id).with_suffix(".part")
            part.unlink(missing_ok=True)  # whatever it is
            part.write_bytes(content)
            part.rename(self.log(id))
        except OSError as error:
            raise CampaignError(
                f"{self.log(id)}: {error.strerror}; finished cases are kept: make room, and resume"
            ) from None

    def _write(self, statement: str, values: tuple[Any, ...]) -> None:
        try:
            self._db.execute(statement, values)
        except sqlite3.Error as error:
            raise CampaignError(
                f"{self.folder / 'results.sqlite'}: {error}; finished cases are kept: make room, and resume"
            ) from None


class Results:
    """The results of a campaign's cases, in the order of its file."""

    def __init__(self, cases: list[Case], rows: dict[str, dict[str, Any]], folder: Path) -> None:
        self.cases, self._rows, self.folder = cases, rows, folder

    def __len__(self) -> int:
        return len(self._rows)

    def row(self, case: Case) -> dict[str, Any] | None:
        """The result of a case; None: it was not run yet."""
        return self._rows.get(case.id)

    @property
    def done(self) -> list[tuple[Case, dict[str, Any]]]:
        """All cases that have a result, with it."""
        return [(case, self._rows[case.id]) for case in self.cases if case.id in self._rows]

    @property
    def failed(self) -> list[tuple[Case, dict[str, Any]]]:
        return [(case, row) for case, row in self.done if row["status"] != "passed"]

    def log(self, case: Case) -> Path | None:
        """The log of a case that was kept: what acted on it, for `ruedo verify`."""
        log = _log_of(self.folder, case.id)
        return log if log.exists() else None

    def table(self) -> list[dict[str, Any]]:
        """A row a case. Wall-clock times are not in it: the table is the same from every
        machine.
        """
        parameters = list(dict.fromkeys(name for case in self.cases for name in case.parameters))
        metrics = sorted({name for _, row in self.done for name in row["metrics"]})
        table = []
        for case, row in self.done:
            one: dict[str, Any] = {
                "number": case.number,
                "id": case.id,
                "world": case.world,
                "robot": case.robot,
                "controller": case.controller,
                "seed": case.seed,
            }
            one |= {name: case.parameters.get(name) for name in parameters}
            one |= {
                "status": row["status"],
                "passed": row["status"] == "passed",
                "what": row["what"],
                "reason": row["reason"],
                "state_hash": row["state_hash"],
            }
            table.append(one | {name: row["metrics"].get(name) for name in metrics})
        return table

    def csv(self) -> str:
        table = self.table()
        text = io.StringIO()
        writer = csv.DictWriter(
            text, list(table[0]) if table else list(COLUMNS), lineterminator="\n"
        )
        writer.writeheader()
        writer.writerows(table)
        return text.getvalue()

    def frame(self) -> Any:
        """The table as a pandas DataFrame."""
        try:
            import pandas
        except ImportError:
            raise missing("pandas", "campaign") from None
        return pandas.DataFrame(self.table())

    def parquet(self, file: str) -> None:
        try:
            import pyarrow  # noqa: F401
        except ImportError:
            raise missing("pyarrow", "campaign") from None
        self.frame().to_parquet(file, index=False)

    def junit(self, name: str) -> str:
        """JUnit XML for CI, with a test case for each case."""
        from xml.etree import ElementTree

        suite = ElementTree.Element(
            "testsuite", name=name, tests=str(len(self.done)), failures=str(len(self.failed))
        )
        for case, row in self.done:
            title = ", ".join(f"{key}={value}" for key, value in case.parameters.items())
            test = ElementTree.SubElement(
                suite,
                "testcase",
                classname=_printable(f"{case.world}.{case.controller}"),
                name=_printable(f"{case.number} seed={case.seed} {title}".strip()),
                time=f"{row['wall_s']:.3f}",
            )
            if row["status"] != "passed":
                failure = ElementTree.SubElement(
                    test,
                    "failure",
                    type=_printable(f"{row['status']}: {row['what']}"),
                    message=_printable(row["reason"]),
                )
                failure.text = _printable(row["output"])
            else:
                ElementTree.SubElement(test, "system-out").text = _printable(row["reason"])
        return (
            "<?xml version='1.0' encoding='UTF-8'?>\n"
            + ElementTree.tostring(suite, encoding="unicode")
            + "\n"
        )


def _log_of(folder: Path, id: str) -> Path:
    return folder / "logs" / f"{id}.lcm"


def _copy_of(file: Path) -> tempfile.TemporaryDirectory[str]:
    """A copy for reading in a folder without write access, since SQLite writes files beside the
    database. Raises OSError.
    """
    folder = tempfile.TemporaryDirectory(prefix="ruedo-results-")
    for one in (file, file.with_name(file.name + "-wal")):
        if one.exists():
            with open_regular(one) as source, open(Path(folder.name) / one.name, "wb") as target:
                shutil.copyfileobj(source, target)
    return folder


def _fits(value: float) -> bool:
    """Raises OverflowError for a whole number beyond all others."""
    return float(value) == value or value != value


def _printable(text: str) -> str:
    """The text without characters that XML forbids."""
    return "".join(
        c
        for c in text
        if c in "\t\n"
        or (ord(c) >= 32 and not 0xD800 <= ord(c) < 0xE000 and ord(c) not in (0xFFFE, 0xFFFF))
    )
