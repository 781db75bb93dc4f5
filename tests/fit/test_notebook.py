"""The example notebook runs, and its simulation is like its "real" drive."""

from __future__ import annotations

import json

from conftest import SOURCE


def test_notebook_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    notebook = json.loads(
        (SOURCE / "clients/python/examples/course/evening_9_fit.ipynb").read_text()
    )
    names = {}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
    rows = {row.name: row.as_dict() for row in names["found"].rows}
    assert rows["all"]["kolmogorov_smirnov"] < 0.1
    real, made = (q[1] for q in rows["heading after 1 m"]["quantiles"])
    assert abs(made / real - 1) < 0.3
    track = next(one for one in names["fitted"].parts["Odometry"] if one.name == "track error")
    assert track.low < 0.03 < track.high or abs(track.value - 0.03) < 0.005
