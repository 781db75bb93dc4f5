"""The fronts of campaigns and hunts: a plan in one line of YAML, and what is done with it."""

import os
import subprocess
import sys

import yaml

PATIENCE = 400  # s
PLAN = {
    "worlds": ["box.sdf"],
    "disable": ["p3at/camera", "p3at/sonar_front", "p3at/sonar_rear"],
    "expect": {"no_contact": True},
    "limits": {"duration": 5, "wall": 100},
}


def campaign(line, folder):
    """A plan -- a line for bash, by default `c run c.yaml`; c is `ruedo campaign`."""
    return _bash(_plan(line, folder) or "c run c.yaml --workers 1", folder)


def hunt(line, folder):
    """A plan -- the options of `ruedo hunt`, and after ; a line for bash. Exit code 1: found."""
    options, _, rest = _plan(line, folder).partition(";")
    found = f'"$RUEDO" hunt c.yaml --workers 1 --shrink 20 {options or "--cases 12"}'
    return _bash(f"{found}; {rest}" if rest else found, folder)


def _plan(line, folder):
    """c.yaml of a plan's members, `python: NAME` for its controller; returns what follows --."""
    text, _, rest = line.partition(" -- ")
    given = yaml.safe_load("{" + text + "}")
    if "python" in given:
        given["controllers"] = [{"name": "c", "python": f"controllers.py:{given.pop('python')}"}]
    content = {key: value for key, value in {**PLAN, **given}.items() if value != {}}
    (folder / "c.yaml").write_text(yaml.safe_dump(content))
    return rest


def _bash(line, folder):
    done = subprocess.run(
        ["bash", "-c", f'c() {{ "$RUEDO" campaign "$@"; }}; {line}'],
        cwd=folder,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=PATIENCE,
        env={**os.environ, "RUEDO_PYTHON": sys.executable},
    )
    return done.returncode, done.stdout + done.stderr
