"""A found case as a folder that ctest and pytest run from then on."""

from __future__ import annotations

import os
import re
import shlex
import shutil
from pathlib import Path
from typing import Any

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
    import yaml

    folder.mkdir(parents=True, exist_ok=True)
    name = re.sub(r"\W", "_", folder.name)
    content = dict(found.content)
    world = found.case.what["world"]
    if os.path.isfile(world["file"]):
        shutil.copyfile(world["file"], folder / "world.sdf")
        content["worlds"] = [{"name": world["name"], "file": "world.sdf"}]
    content["controllers"] = [moved(one, found.folder, folder) for one in content["controllers"]]
    text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
    (folder / "regression.yaml").write_text(
        f"# Found by `ruedo hunt`: {found.reason}\n{text}", encoding="utf-8"
    )
    (folder / f"test_{name}.py").write_text(
        _PYTEST.format(name=name, reason=found.reason),
        encoding="utf-8",
    )
    (folder / "CMakeLists.txt").write_text(
        _CMAKE.format(name=name, folder=folder.name), encoding="utf-8"
    )
    (folder / "run.lcm").write_bytes(found.outcome["log"])
    return folder


def moved(controller: dict[str, Any], home: Path, folder: Path) -> dict[str, Any]:
    """A controller for a campaign in that folder; its own files stay where they are: in `home`."""
    made = dict(controller)
    way = os.path.relpath(home, folder)
    files = made.pop("files", [])
    if ".py:" in made.get("python", ""):
        made["python"] = os.path.join(way, made["python"])
    if "command" in made:
        words = re.findall(r"[\w./-]+\.\w+", made["command"])
        files = [*files, *(word for word in words if os.path.isfile(home / word))]
        made["command"] = f"cd {shlex.quote(way)} && {made['command']}"
    if files:
        made["files"] = [os.path.join(way, one) for one in dict.fromkeys(files)]
    return made
