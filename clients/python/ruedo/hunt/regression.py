"""A found case as a folder that ctest and pytest run from then on."""

from __future__ import annotations

import glob
import os
import re
import shlex
import shutil
import tempfile
from pathlib import Path
from typing import Any

from ..campaign import Campaign
from ..campaign.errors import CampaignError, UsageError
from ..campaign.outputs import check_writable
from ..campaign.plan import words_of
from ..campaign.worlds import beside, copy_beside, model_of
from ..errors import for_terminal
from ..files import dump_yaml

_PYTEST = '''# Found by `ruedo hunt`: {reason}

from pathlib import Path

from ruedo.campaign import Campaign


def test_{name}(tmp_path):
    results = Campaign(Path(__file__).with_name("regression.yaml"), out=tmp_path / "out").run(workers=1)
    assert not results.failed, results.failed[0][1]["reason"]
'''

_CMAKE = '''# Found by `ruedo hunt`. In your CMakeLists.txt: add_subdirectory({folder})
add_test(NAME hunt.{name} COMMAND ruedo campaign run ${{CMAKE_CURRENT_SOURCE_DIR}}/regression.yaml
  --out ${{CMAKE_CURRENT_BINARY_DIR}}/{name}.campaign --workers 1 --quiet)
'''


def keep(found: Any, folder: Path) -> Path:
    """world.sdf, regression.yaml (a campaign of one case), test_NAME.py, CMakeLists.txt, and
    run.lcm, the log of the run that failed.
    """
    check_keep(folder)
    folder.mkdir(parents=True, exist_ok=True)
    name = re.sub(r"\W", "_", folder.name)
    reason = for_terminal(found.reason)  # an untrusted text, in comments
    content = dict(found.content)
    world = found.case.what["world"]
    home, places = beside(world["file"], found.files, found.folder)
    copy_beside(places, folder)
    model = model_of(world["spawn"])
    if model in places:
        content["robots"] = [f"{places[model]}{world['spawn'][len(model) :]}"]
    if os.path.isfile(world["file"]):
        file = home / _new_name("world.sdf", {str(one) for one in places.values()}, home)
        (folder / file.parent).mkdir(parents=True, exist_ok=True)
        shutil.copyfile(world["file"], folder / file)
        content["worlds"] = [{"name": world["name"], "file": str(file)}]
    content["controllers"] = [moved(one, found.folder, folder) for one in content["controllers"]]
    if "metrics" in content:
        content["metrics"] = [moved(one, found.folder, folder) for one in content["metrics"]]
    if "inputs" in content:
        way = glob.escape(os.path.relpath(found.folder, folder))
        content["inputs"] = [os.path.join(way, one) for one in content["inputs"]]
    if "golden" in content["expect"]:
        golden = os.path.join(os.path.relpath(found.folder, folder), content["expect"]["golden"])
        content["expect"] = {**content["expect"], "golden": golden}
    (folder / "regression.yaml").write_text(
        f"# Found by `ruedo hunt`: {reason}\n{dump_yaml(content)}", encoding="utf-8"
    )
    (folder / f"test_{name}.py").write_text(
        _PYTEST.format(name=name, reason=reason),
        encoding="utf-8",
    )
    (folder / "CMakeLists.txt").write_text(
        _CMAKE.format(name=name, folder=for_terminal(folder.name)), encoding="utf-8"
    )
    (folder / "run.lcm").write_bytes(found.outcome["log"])
    _check_that_it_fails(found, folder)
    return folder


def check_keep(folder: Path) -> None:
    """Raises UsageError for a folder that holds anything, which would be mixed with the find, and
    OSError where none can be made.
    """
    if os.path.lexists(folder) and (not folder.is_dir() or any(folder.iterdir())):
        raise UsageError(f"{folder} is there already: keep what is found in a new folder")
    there = folder
    while not there.exists():
        there = there.parent
    check_writable(there)


def _new_name(name: str, taken: set[str], home: Path) -> str:
    while str(home / name) in taken:
        name = f"hunted_{name}"
    return name


def _check_that_it_fails(found: Any, folder: Path) -> None:
    """A test that passes at once would stand for a mended controller."""
    with tempfile.TemporaryDirectory(prefix="ruedo-kept-") as out:
        results = Campaign(folder / "regression.yaml", out=out).run(workers=1)
    ((_, row),) = results.done
    if (row["status"], row["what"]) != (found.outcome["status"], found.outcome["what"]):
        raise CampaignError(
            f"{folder}: what was kept there does not fail as it did ({found.reason}): "
            f"it {row['status']} {row['reason']}".rstrip()
        )


def moved(controller: dict[str, Any], home: Path, folder: Path) -> dict[str, Any]:
    """A controller or metric for a campaign in that folder; its own files stay where they are: in
    `home`.
    """
    made = dict(controller)
    way = os.path.relpath(home, folder)
    files, inputs, others = (list(made.pop(key, [])) for key in ("files", "inputs", "others"))
    module, _, name = made.get("python", "").partition(":")
    if module and os.path.isfile(home / f"{module}.py"):
        module += ".py"
    if module.endswith(".py"):
        made["python"] = os.path.join(way, f"{module}:{name}")
    if "command" in made:
        words = sorted(words_of(made["command"]) - {""})
        named = [glob.escape(word) for word in words if os.path.isfile(home / word)]
        inputs += named if files else ["", *named]  # the whole folder counts there, too
        made["command"] = f"cd {shlex.quote(way)} && {made['command']}"
    for key, patterns in (("files", files), ("inputs", inputs), ("others", others)):
        if patterns:
            there = [os.path.join(glob.escape(way), one) for one in dict.fromkeys(patterns)]
            made[key] = [one.rstrip("/") for one in there]
    return made
