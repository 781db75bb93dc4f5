"""The notebook of clients/python/examples/learners runs: a policy, where it fails, and the proof
that a change mends it.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[2] / "clients/python/examples"


def test_notebook_runs(tmp_path, monkeypatch):
    for folder in ("learners", "navigate"):
        shutil.copytree(EXAMPLES / folder, tmp_path / folder)
    monkeypatch.chdir(tmp_path / "learners")
    monkeypatch.setattr(sys, "path", [*sys.path])
    notebook = json.loads(Path("proof.ipynb").read_text())
    names = {}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
    # Where the policy was trained, over LCM, and before the referee it is as good.
    assert 180 <= names["success"].sum() <= 190
    assert names["driven"].count("success") >= 4
    assert 170 <= names["frame"].passed.sum() <= 190
    failed = names["frame"][names["frame"].passed == 0]
    assert failed.reason.str.contains("_wheel touched obstacle").mean() > 0.8
    # The hunt's find fails until it is mended; the guard mends more rooms than it breaks.
    assert "touched hunted_" in names["found"].reason
    assert names["before"].frame().passed.tolist() == [0]
    assert names["after"].frame().passed.tolist() == [1]
    assert names["both"].passed_guarded.sum() > names["both"].passed.sum() + 5
    kept_test = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "kept/corner"]
    done = subprocess.run(kept_test, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout
    # The hunt's file as the command line takes it.
    words = [os.environ["RUEDO"], "hunt", "hunt.yaml", "--json", "--cases", "100"]
    named = {**os.environ, "RUEDO_PYTHON": sys.executable}
    done = subprocess.run(words, env=named, capture_output=True, text=True, timeout=300)
    assert done.returncode == 1, done.stdout + done.stderr
    assert json.loads(done.stdout)["choices"] == names["found"].choices
