"""A found case as a folder that ctest and pytest run from then on."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path
from typing import Any

_PYTEST = '''"""Found by `ruedo hunt`: {reason}"""

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
    if Path(world["file"]).is_file():
        shutil.copyfile(world["file"], folder / "world.sdf")
        content["worlds"] = [{"name": world["name"], "file": "world.sdf"}]
    home = os.path.relpath(found.folder, folder)
    content["controllers"] = [_moved(one, home) for one in content["controllers"]]
    text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
    (folder / "regression.yaml").write_text(
        f"# Found by `ruedo hunt`: {found.reason}\n{text}", encoding="utf-8"
    )
    (folder / f"test_{name}.py").write_text(
        _PYTEST.format(name=name, reason=found.reason.replace('"""', "'''").replace("\\", "/")),
        encoding="utf-8",
    )
    (folder / "CMakeLists.txt").write_text(
        _CMAKE.format(name=name, folder=folder.name), encoding="utf-8"
    )
    (folder / "run.lcm").write_bytes(found.outcome["log"])
    return folder


def _moved(controller: dict[str, Any], home: str) -> dict[str, Any]:
    """Its files stay where they are."""
    moved = dict(controller)
    if ".py:" in moved.get("python", ""):
        moved["python"] = os.path.join(home, moved["python"])
    if "command" in moved:
        moved["files"] = [*moved.get("files", []), *re.findall(r"[\w./-]+\.\w+", moved["command"])]
        moved["files"] = [
            one
            for one in dict.fromkeys(moved["files"])
            if (Path(home) / one).exists() or "*" in one
        ]
        moved["command"] = f"cd {home} && {moved['command']}"
    moved["files"] = [os.path.join(home, one) for one in moved.get("files", [])]
    return {key: value for key, value in moved.items() if value != []}
