"""Campaign: the file, its cases, and their runs on whatever engine."""

from __future__ import annotations

import fcntl
import glob
import json
import os
import re
import shlex
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from .. import _engine
from ..files import MOST_YAML_BYTES, open_lock, read_bytes, sha256_of
from .cluster import run_on_ray
from .errors import CampaignError, SpecError
from .inputs import Folders, is_read
from .local import Crew, Done, cores
from .names import check_names
from .plan import Case, Planner, check_values, files_called, shard_of
from .schema import CONTROLLER_NAME, HALF, NAME_RULES, Source, check, read_yaml
from .store import Results, Store
from .worlds import WorldFiles

_REMEMBERED = ("number", "id", "world", "robot", "controller", "seed", "parameters")

_RESULTS = ("results.sqlite*", "lock", "logs/*", "worlds/*")  # in the folder of the results

Progress = Callable[[Case, dict[str, Any]], None]


class Campaign:
    """Many runs of one experiment.

    spec: a YAML file, or the same members as a dict; a dict's paths begin in `folder`. out: where
    the results go, default NAME.campaign beside the file. Raises SpecError for what is wrong in the
    file.
    """

    def __init__(
        self,
        spec: str | os.PathLike[str] | dict[str, Any],
        *,
        folder: str | os.PathLike[str] = ".",
        out: str | os.PathLike[str] | None = None,
    ) -> None:
        if isinstance(spec, dict):
            self.source = Source("campaign")
            try:
                self._content = json.loads(json.dumps(spec))
            except (TypeError, ValueError, RecursionError) as error:
                raise SpecError(f"campaign: it holds what no file can: {error}") from None
            self.folder = Path(folder).resolve()
            self.file: Path | None = None
            stem = spec["name"] if isinstance(spec.get("name"), str) else "campaign"
        else:
            file = Path(spec)
            try:
                text = read_bytes(file, MOST_YAML_BYTES).decode()
            except OSError as error:
                raise SpecError(f"{file}: cannot be read: {error.strerror or error}") from None
            except UnicodeDecodeError as error:
                raise SpecError(f"{file}: is not UTF-8: byte {error.start} is invalid") from None
            self._content, self.source = read_yaml(str(file), text)
            self.file, self.folder, stem = file.resolve(), file.resolve().parent, file.stem
        check(self._content, self.source)
        self._content["controllers"] = list(self._each_controller())
        check_values(self._content, self.source)
        self.name = str(self._content.get("name", stem))
        self.out = Path(out) if out else self.folder / f"{stem}.campaign"
        self.version = str(_engine.build)
        self._cases: list[Case] | None = None
        self.worlds = WorldFiles(self.folder, self.out / "worlds")
        self.folders = Folders(self.out)
        self._named: set[str] = set()
        self.outputs: set[str] = set()  # that the last run() has seen written in those folders
        self._files: dict[str, str] = {}  # that the cases are made from, with their hashes

    @property
    def content(self) -> dict[str, Any]:
        """The file's members."""
        return self._content

    @property
    def cases(self) -> list[Case]:
        """All cases, in the order of the file. Worlds are made and read on first use."""
        if self._cases is None:
            self.folders.leave_out(self._outputs())
            planner = Planner(
                self._content,
                self.source,
                self.folder,
                self.out / "worlds",
                self.version,
                self.worlds,
                self.folders,
            )
            self._cases = planner.cases()
            self._files, self._named = planner.files, planner.named_files
        return self._cases

    @property
    def files_read(self) -> list[Path]:
        """The campaign's file, all that its cases are made from, and its results."""
        made_from = [Path(file) for file in self._files] if self.cases else []
        results = [one for kind in _RESULTS for one in self.out.glob(kind)]
        return [*([self.file] if self.file else []), *made_from, *results]

    def run(
        self,
        *,
        workers: int | None = None,
        ray: str | None = None,
        shard: str | None = None,
        progress: Progress | None = None,
        stop: Callable[[], bool] = lambda: False,
    ) -> Results:
        """Runs what has no result yet, and returns all results.

        workers: processes on this machine, default one a core. ray: "auto" or an address, the same
        on a Ray cluster. shard: "I/N", every N-th case from the I-th on. stop: True ends the
        campaign early.
        """
        cases = shard_of(self.cases, shard) if shard else self.cases
        with Store(self.out) as store, _lock(self.out):
            self._tell_about(store)
            known = store.known()
            missing = [case for case in cases if case.id not in known]
            check_names(missing, self.source, self.folder)
            sample = self._sampled()
            files = Unchanged(self._inputs())
            try:
                for case, outcome, wall_s in self._outcomes(missing, workers, ray):
                    files.check()
                    keep = (
                        outcome["status"] != "passed"
                        if self._content.get("keep", {}).get("failures", True)
                        else False
                    )
                    store.add(case.id, outcome, wall_s, keep or case.id in sample)
                    if progress:
                        progress(case, outcome)
                    if stop():
                        break
            finally:
                self.outputs = self.folders.written_since() if missing else set()
                known_outputs = _set_of(store.about("outputs"))
                store.set_about("outputs", json.dumps(sorted(known_outputs | self.outputs)))
            return Results(cases, store.rows(case.id for case in cases), self.out)

    def results(self, shard: str | None = None) -> Results:
        """The results so far."""
        cases = shard_of(self.cases, shard) if shard else self.cases
        anything = (self.out / "results.sqlite").is_file()
        with Store(self.out, write=not anything) as store:
            return Results(cases, store.rows(case.id for case in cases), self.out)

    def changes(self) -> list[str]:
        """The files that its cases are made from and that have changed, come or gone since its
        cases were last run: each result of before stands for them no more.
        """
        now = self._by_name() if self.cases else {}
        if not (self.out / "results.sqlite").is_file():
            return []
        with Store(self.out, write=False) as store:
            before = json.loads(store.about("files") or "null")
        if not isinstance(before, dict):
            return []
        return sorted(name for name in before.keys() | now if before.get(name) != now.get(name))

    def _tell_about(self, store: Store) -> None:
        about = {
            "name": self.name,
            "content": self._content,
            "folder": str(self.folder),
            "version": self.version,
        }
        store.set_about("campaign", json.dumps(about))
        remembered = [{key: getattr(case, key) for key in _REMEMBERED} for case in self.cases]
        store.set_about("cases", json.dumps(remembered))  # also other shards', which may be here
        store.set_about("files", json.dumps(self._by_name()))

    def _inputs(self) -> dict[str, str]:
        """The input files, which nothing may write while the cases run, with their hashes."""
        return {
            file: sha256
            for file, sha256 in self._files.items()
            if file in self._named or is_read(file)
        }

    def _outputs(self) -> set[str]:
        """The files in the controllers' folders that its cases have written: no inputs."""
        if not (self.out / "results.sqlite").is_file():
            return set()
        with Store(self.out, write=False) as store:
            return _set_of(store.about("outputs"))

    def _by_name(self) -> dict[str, str]:
        return {os.path.relpath(file, self.folder): sha256 for file, sha256 in self._files.items()}

    def join(self, folders: Iterable[str | os.PathLike[str]]) -> int:
        """Takes over the results of shards; how many."""
        with Store(self.out) as store, _lock(self.out):
            store.set_about(
                "cases",
                json.dumps(
                    [{key: getattr(case, key) for key in _REMEMBERED} for case in self.cases]
                ),
            )
            taken = 0
            for one in folders:
                with Store(Path(one), write=False) as other:
                    taken += store.take(other)
            return taken

    def case(self, text: str) -> Case:
        """The case with this number, or whose id begins so."""
        found = [case for case in self.cases if str(case.number) == text] or [
            case for case in self.cases if len(text) >= 4 and case.id.startswith(text)
        ]
        if len(found) != 1:
            raise SpecError(
                f"{text} is {'several cases' if found else 'not a case'} of {self.name}: a number from 0 "
                f"to {len(self.cases) - 1}, or the first 4 digits or more of an id"
            )
        return found[0]

    def _each_controller(self) -> Iterator[dict[str, Any]]:
        """A controller with `each` is one for each file: {file} is its path, and its name, without
        ending, the controller's. A student may call a file whatever they like.
        """
        for i, one in enumerate(self._content["controllers"]):
            if "each" not in one:
                yield one
                continue
            for file in files_called(
                one["each"], self.folder, ("controllers", i, "each"), self.source
            ):
                path = str(file.relative_to(self.folder))
                if HALF.search(path):
                    raise self.source.error(
                        ("controllers", i, "each"),
                        f"is {one['each']!r}, and the name of {path!r} is not UTF-8: rename it",
                    )
                if not re.search(CONTROLLER_NAME, file.stem):
                    raise self.source.error(
                        ("controllers", i, "each"),
                        f"is {one['each']!r}, and {path!r} cannot name a controller, which has "
                        f"{NAME_RULES[CONTROLLER_NAME]}: rename it",
                    )
                text = path.replace("{", "{{").replace("}", "}}")  # of braces no parameters
                in_a_shell = shlex.quote(text)
                made = {
                    key: value.replace("{file}", in_a_shell if key == "command" else text)
                    if isinstance(value, str)
                    else value
                    for key, value in one.items()
                    if key != "each"
                }
                if "command" in made:  # however the command names it
                    made["inputs"] = [*made.get("inputs", []), glob.escape(path)]
                made["others"] = [*made.get("others", []), one["each"]]
                yield {**made, "name": file.stem}

    def _sampled(self) -> set[str]:
        """Cases whose log is kept however they end: those with the lowest ids, which are as good as
        drawn.
        """
        count = self._content.get("keep", {}).get("sample", 0)
        return set(sorted(case.id for case in self.cases)[:count])

    def _outcomes(self, cases: list[Case], workers: int | None, ray: str | None) -> Iterator[Done]:
        if ray is not None:
            return run_on_ray(cases, str(self.folder), self._files, ray, self.version)
        count = cores() if workers is None else workers
        if count < 1:
            raise CampaignError(f"{count} workers: 1 or more are needed")
        return _on_this_machine(cases, str(self.folder), count)


def _set_of(text: str | None) -> set[str]:
    known = json.loads(text or "[]")
    return {one for one in known if isinstance(one, str)} if isinstance(known, list) else set()


def _on_this_machine(cases: list[Case], folder: str, workers: int) -> Iterator[Done]:
    with Crew(folder, workers) as crew:
        yield from crew.run(cases)


class Unchanged:
    """Whether the files are unchanged since the cases were made. Reads the content only of files
    whose time or size has changed.
    """

    def __init__(self, files: dict[str, str]) -> None:
        self._files = files
        self._touched: dict[str, tuple[int, ...]] = {}

    def check(self) -> None:
        """Raises CampaignError: what was run since may be of either content."""
        for file, sha256 in self._files.items():
            try:
                found = os.stat(file)
                touched = (found.st_mtime_ns, found.st_ctime_ns, found.st_size, found.st_ino)
                if touched == self._touched.get(file):
                    continue
                changed = sha256_of(file) != sha256
            except OSError:
                changed = True
            if changed:
                raise CampaignError(
                    f"{file} was changed while its cases ran; earlier results are kept, "
                    "`ruedo campaign resume` runs the others with the new content; if a controller "
                    "writes it, list in `files` the files that it is made of"
                )
            self._touched[file] = touched


class _lock:
    """Admits one driver at a time; the kernel releases it when its holder ends, however it ends."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __enter__(self) -> None:
        try:
            self._file = open_lock(self._folder / "lock")
        except OSError as error:
            raise CampaignError(f"{self._folder / 'lock'}: {error.strerror or error}") from None
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._file)
            raise CampaignError(
                f"{self._folder} is in use by another `ruedo campaign run`"
            ) from None

    def __exit__(self, *_: object) -> None:
        os.close(self._file)
