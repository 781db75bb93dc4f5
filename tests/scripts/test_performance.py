"""benchmarks/performance: what it writes of given rows, and where."""

import importlib.machinery
import importlib.util
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LOADER = importlib.machinery.SourceFileLoader("performance", f"{ROOT}/benchmarks/performance")
SPEC = importlib.util.spec_from_loader("performance", LOADER)
assert SPEC
performance = importlib.util.module_from_spec(SPEC)
LOADER.exec_module(performance)

BENCH = {"table": "x", "robots": 1000, "real_time_factor": 4.002, "sim_s": 4.0, "cpu_s": 1.92}
PEERS = [
    {"Robots": 1.0, "Simulator": "Ruedo", "x real time": 3400.0, "Ruedo is faster by": 1.0}
    | {"by CPU": 1.0},
    {"Robots": 1.0, "Simulator": "MuJoCo 4.0.0", "x real time": 367.0, "Ruedo is faster by": 9.26}
    | {"by CPU": 6.0},
    {"Robots": 1.0, "Simulator": "IR-SIM 2", "x real time": "-", "Ruedo is faster by": "-"}
    | {"by CPU": "-"},
]
ROWS = {
    "robots": [BENCH | {"memory_mb": 193.2}],
    "peers": PEERS,
    "environments": [{"Environments": 1.0, "Simulator": "Ruedo", "steps/s": 33700.0}],
    "rays": [
        {"robots": 1000, "rays_per_s": 1.5e7, "embree_rays_per_s": 1.1e7, "ratio_to_embree": 0.73}
    ],
    "camera": [BENCH | {"robots": 1, "pictures_per_s": 96.0}],
    "latency": [{"what": "command", "median_ms": 2.9, "p99_ms": 5.5, "max_ms": 5.7}],
    "of": dict.fromkeys(("robots", "peers", "environments", "rays", "camera", "latency"), "THIS"),
}


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.2431, "0.243"), (49.7, "49.7"), (999.9, "1 000"), (1000, "1 000"), (3412.0, "3 410")]
    + [(156432.0, "156 000"), ("-", "-")],
)
def test_numbers_have_three_digits(value, text):
    assert performance.number(value) == text


def test_each_table_is_written_to_its_place_and_nothing_else_changes(tmp_path):
    pages = [*performance.PAGES.values(), performance.PAGE]
    for page in pages:
        (tmp_path / page).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / page, tmp_path / page)
    performance.write(ROWS, tmp_path)
    performance.write(ROWS, tmp_path)  # its places are still there
    text = (tmp_path / performance.PAGE).read_text()
    assert "| 1 000 | 4 | 0.48 | 193 MB |\n\nMeasured with THIS.\n<!-- end -->" in text
    assert "| 1 | MuJoCo 4.0.0 | 367 | 9.26 | 6 |" in text
    assert "| 1 | Ruedo | 33 700 |" in (tmp_path / "docs/environments.md").read_text()
    readme = (tmp_path / "README.md").read_text()
    assert (
        "| one robot with laser range finder, 16 sonars, odometry | 3 400 times real time | "
        "9.26 times MuJoCo (by CPU time 6) |\n" in readme
    )
    for page in pages:
        before, after = (ROOT / page).read_text(), (tmp_path / page).read_text()
        assert before.split("<!--")[0] == after.split("<!--")[0]
        assert before.rpartition("<!-- end -->")[2] == after.rpartition("<!-- end -->")[2]


def test_a_table_without_a_place_is_an_error():
    with pytest.raises(ValueError, match="there is no <!-- robots --> to write to"):
        performance.replaced("no table here", "robots", "")
