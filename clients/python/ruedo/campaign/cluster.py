"""The same cases on a Ray cluster: Ray places them, moves what they need, and starts again what it
lost.
"""

from __future__ import annotations

import logging
import os
import socket
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .bundle import Bundle, log_moved, moved, name_of, pack, unpack
from .errors import CampaignError, missing
from .local import Crew, Done, failed
from .plan import DEFAULT_MEMORY_MB, Case

_AHEAD = 4  # cases that wait at the cluster for each core
_RETRIES = 5  # of a case whose node was lost
_LOOK_S = 1.0  # between looks at the head node while no case ends
_PATIENCE_S = 10.0  # that it may be away; Ray ends the whole program after 60
_crew: tuple[str, Crew] | None = None  # of a process of Ray's, in a folder; stays from case to case


def run_on_ray(
    cases: list[Case], folder: str, files: Iterable[str], address: str, version: str
) -> Iterator[Done]:
    """Outcomes as they come. files: of the campaign; those in its folder are brought to each node
    once.
    """
    try:
        import ray
    except ImportError:
        raise missing("Ray", "ray") from None
    joined, lost = not ray.is_initialized(), ""
    with _quiet():
        if joined:
            _join(ray, address)
        try:
            yield from _run(ray, cases, folder, pack(Path(folder), files), address, version)
        except (
            ray.exceptions.RaySystemError,
            ray.exceptions.RayActorError,
            ConnectionError,
        ) as error:
            lost = str(error).splitlines()[0]
        finally:
            if joined and not lost:
                ray.shutdown()
    if lost:
        raise CampaignError(
            f"the Ray cluster was lost: {lost}; finished cases are kept, `ruedo campaign resume` runs "
            "the others"
        )


def _join(ray: Any, address: str) -> None:
    _knock(address)
    try:
        ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
    except Exception as error:
        raise CampaignError(
            f"--ray {address}: no cluster answers: {str(error).splitlines()[0]}"
        ) from None


@contextmanager
def _quiet() -> Iterator[None]:
    """Python alone writes to standard error: Ray's libraries fill pages when a node is lost, which
    are in Ray's own logs, too.
    """
    before, kept, nowhere = sys.stderr, os.dup(2), os.open(os.devnull, os.O_WRONLY)
    if before is sys.__stderr__ and before is not None:
        before.flush()
        sys.stderr = open(kept, "w", buffering=1, closefd=False)
    os.dup2(nowhere, 2)
    os.close(nowhere)
    try:
        yield
    finally:
        sys.stderr.flush()
        sys.stderr = before
        os.dup2(kept, 2)
        os.close(kept)


class _Head:
    """Looks whether the cluster's head node is there, since Ray says so only after a minute, and
    ends the program then.
    """

    def __init__(self, address: str) -> None:
        host, _, port = address.removeprefix("ray://").rpartition(":")
        self._place = (host, int(port))
        self._looked = 0.0
        self._known = self._answers()  # else it is where this machine cannot look

    def is_there(self) -> bool:
        """At most one True in _LOOK_S. Raises ConnectionError when it is away for too long."""
        if time.monotonic() < self._looked + _LOOK_S:
            return False
        self.wait()
        self._looked = time.monotonic()
        return True

    def wait(self) -> None:
        """Until it answers; raises ConnectionError when it does not."""
        until = time.monotonic() + _PATIENCE_S
        while self._known and not self._answers():
            if time.monotonic() > until:
                raise ConnectionError(
                    f"its head node {self._place[0]}:{self._place[1]} does not answer"
                )
            time.sleep(_LOOK_S / 10)

    def _answers(self) -> bool:
        try:
            socket.create_connection(self._place, _PATIENCE_S).close()
        except OSError:
            return False
        return True


def _knock(address: str) -> None:
    """Raises at once if nothing listens at the address; Ray itself takes minutes."""
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if not colon or not port.isdigit():
        return  # "auto", "local", a name that Ray knows
    try:
        socket.create_connection((host, int(port)), 10.0).close()
    except OSError as error:
        raise CampaignError(
            f"--ray {address}: no cluster answers: {error.strerror or error}"
        ) from None


def _run(
    ray: Any, cases: list[Case], folder: str, bundle: Bundle, address: str, version: str
) -> Iterator[Done]:
    limits = {case.what["limits"]["memory_mb"] for case in cases}
    memory = 0 if limits <= {DEFAULT_MEMORY_MB} else max(limits) << 20
    largest = max(
        (node["Resources"].get("memory", 0) for node in ray.nodes() if node["Alive"]), default=0
    )
    if memory > largest:
        raise CampaignError(
            f"a case may take {memory >> 20} MB (limits.memory_mb), and no node of the cluster has more than "
            f"{int(largest) >> 20} MB"
        )
    name, packed = name_of(bundle), ray.put(bundle)
    remote = ray.remote(_remote).options(num_cpus=1, memory=memory, max_retries=_RETRIES)
    waiting = list(reversed(cases))
    running: dict[Any, Case] = {}
    head = _Head(address if address.startswith("ray://") else ray.get_runtime_context().gcs_address)
    cores = 1
    while waiting or running:
        if head.is_there():  # else this would wait for it; nodes come and go
            cores = int(ray.cluster_resources().get("CPU", 1))
        while waiting and len(running) < _AHEAD * max(cores, 1):
            case = waiting.pop()
            running[remote.remote([packed], name, case, folder, version)] = case
        ready, _ = ray.wait(list(running), num_returns=1, timeout=_LOOK_S)
        for one in ready:
            case = running.pop(one)
            try:
                outcome, wall_s, there = ray.get(one)
            except ray.exceptions.RayTaskError as error:
                raise CampaignError(
                    str(error.cause if hasattr(error, "cause") else error).strip().splitlines()[-1]
                ) from None
            except ray.exceptions.RayError as error:
                head.wait()  # without it, it is not the case's fault
                outcome, wall_s, there = (
                    failed(
                        "crashed", f"its node was lost {_RETRIES + 1} times: {type(error).__name__}"
                    ),
                    0.0,
                    folder,
                )
            outcome["log"] = log_moved(outcome["log"], there, folder)
            yield case, outcome, wall_s


def _remote(
    packed: list[Any], name: str, case: Case, folder: str, version: str
) -> tuple[dict[str, Any], float, str]:
    """Runs the case on a node of Ray, in a worker of its own as on one machine."""
    import ray

    from .. import _engine

    here = str(_engine.build)
    if here != version:
        raise CampaignError(
            f"node {ray.util.get_node_ip_address()} has Ruedo {here}, the campaign was started with {version}: "
            "install one build on all of them"
        )
    there = unpack(ray.get(packed[0]), name)
    global _crew
    if _crew and _crew[0] != there:
        _crew[1].end()
        _crew = None
    _crew = _crew or (there, Crew(there))
    case = Case(
        case.number,
        case.id,
        case.world,
        case.robot,
        case.controller,
        case.seed,
        case.parameters,
        moved(case.what, folder, there),
    )
    ((_, outcome, wall_s),) = _crew[1].run([case])
    return outcome, wall_s, there
