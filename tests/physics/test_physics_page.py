"""benchmarks/physics/page.py, which scripts/physics runs: the page of a few tests, and its numbers
against closed forms.
"""

import json
import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ["RUEDO_BINARY_DIR"])
PAGE = ROOT / "benchmarks/physics/page.py"
TESTS = ["flight", "tumbling", "pendulum_small", "creep", "bounce_0.5", "spinning", "arm_velocity"]


def page(*arguments):
    environment = {
        **os.environ,
        "RUEDO": str(BUILD / "bin/ruedo"),
        "PYTHONPATH": str(BUILD / "python"),
    }
    return subprocess.run(
        [sys.executable, PAGE, *arguments],
        capture_output=True,
        text=True,
        timeout=300,
        env=environment,
    )


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    done = page("--out", folder, "--no-peers", "--steps", "5", "--only", *TESTS)
    assert done.returncode == 0, done.stderr
    return folder


def test_every_test_has_a_row_with_its_number(out):
    text = (out / "physics.md").read_text()
    numbers = json.loads((out / "physics/numbers.json").read_text())
    assert sorted(n["test"] for n in numbers) == sorted(TESTS)
    assert text.count("| 5 ms |") == len(TESTS)
    assert "What is not simulated" in text


def test_the_numbers_are_those_of_the_closed_forms(out):
    numbers = {n["test"]: n for n in json.loads((out / "physics/numbers.json").read_text())}
    for test, allowed in (
        ("flight", 1e-9),
        ("tumbling", 1e-4),
        ("pendulum_small", 1e-3),
        ("bounce_0.5", 2e-3),
        ("spinning", 1e-3),
    ):
        assert numbers[test]["values"]["Ruedo"] == pytest.approx(
            numbers[test]["reference"], abs=allowed
        ), test
    assert numbers["flight"]["reference"] == pytest.approx(5 + 3 - 9.81 / 2)
    assert numbers["creep"]["values"]["Ruedo"] < 1.0  # mm in 10 s
    assert numbers["arm_velocity"]["values"]["Ruedo"] < 1e-4  # rad/s


def test_an_unknown_test_and_a_folder_that_cannot_be_written_are_reported(tmp_path):
    done = page("--only", "nonsense")
    assert done.returncode == 2 and "nonsense" in done.stderr
    (tmp_path / "file").write_text("")
    done = page(
        "--out", tmp_path / "file" / "page", "--no-peers", "--only", "flight", "--steps", "5"
    )
    assert done.returncode == 4 and "--out" in done.stderr


def test_the_page_in_docs_has_every_test():
    """What is kept in docs/ was made by the tests that there are now."""
    listed = {line.split()[0] for line in page("--list").stdout.splitlines()}
    kept = {n["test"] for n in json.loads((ROOT / "docs/physics/numbers.json").read_text())}
    assert kept == listed
