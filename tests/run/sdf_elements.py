"""Writes sdf_elements.txt, every element and attribute of SDF 1.12, and sdf_children.inc, what SDF
1.4 to 1.12 has inside of each element: from libsdformat's description files of 1.4 to 1.9 (Debian's
sdformat-sdf) and what 1.10 to 1.12 added and renamed.

    python3 tests/run/sdf_elements.py /usr/share/sdformat12
"""

import sys
import xml.etree.ElementTree as ET
from pathlib import Path

# By the file that describes it, and the path in it: what 1.10 to 1.12 added.
ADDED = {
    "world": ["@namespace", "frame=frame.sdf", "joint=joint.sdf", "include/@merge=bool:false"],
    "model": ["@namespace"],
    "inertial": ["@auto=bool:false", "density=double:1000.0", "auto_inertia_params"],
    "collision": ["density=double:1000.0", "auto_inertia_params"],
    "mesh": ["@optimization", "convex_decomposition/max_convex_hulls=unsigned int:16"],
    "sensor": ["frame_id=string:", "air_speed/pressure=noise.sdf"],
    "geometry": ["cone/radius=double:1.0", "cone/length=double:1.0"],
    "joint": [
        f"{axis}/mimic/{part}"
        for axis in ("axis", "axis2")
        for part in (
            "@joint",
            "@axis",
            "multiplier=double:1.0",
            "offset=double:0",
            "reference=double:0",
        )
    ],
    "camera": [
        "camera_info_topic=string:",
        "trigger_topic=string:",
        "triggered=bool:false",
        "optical_frame_id=string:",
        "image/anti_aliasing=int:4",
        *(f"lens/projection/{part}=double:0.0" for part in ("p_fx", "p_fy", "p_cx", "p_cy")),
        *(f"lens/projection/{part}=double:0.0" for part in ("tx", "ty")),
    ],
}
# 1.12 calls the parts of a <state> so; the older names stay.
STATES = {"model": "model_state", "link": "link_state", "light": "light_state"}
JOINT_STATE = ["@name", "angle=double:0", "angle/@axis"] + [
    f"{axis}/{part}{end}"
    for axis in ("axis_state", "axis2_state")
    for part in ("position", "velocity", "acceleration")
    for end in ("=double:0", "/@degrees=bool:false")
]
# Elements that are described once and occur in many places are listed whole in one of them.
PLACES = {
    "link.sdf": "world/model",
    "joint.sdf": "world/model",
    "model.sdf": "world",
    "light.sdf": "world",
    "sensor.sdf": "world/model/link",
    "geometry.sdf": "world/model/link/collision",
    "material.sdf": "world/model/link/visual",
}


class Reader:
    def __init__(self, folder):
        self.folder = folder
        self.rows = {}

    def add(self, path, kind="", default=""):
        self.rows.setdefault(path, (kind, default))

    def read_file(self, name, path, parents):
        file = self.folder / name
        # Debian's package lacks this one: GPS under its later name.
        if name == "navsat.sdf":
            file = self.folder / "gps.sdf"
        if not file.exists():
            return  # of a later version
        root = ET.parse(file).getroot()
        if name == "navsat.sdf":
            root.set("name", "navsat")
        if path != PLACES.get(name, path):
            self.add(f"{path}/{root.get('name')}")
            return
        self.read(root, path, (*parents, name))

    def read(self, element, path, parents):
        name = element.get("name")
        path = f"{path}/{name}" if path else name
        self.add(path, element.get("type") or "", element.get("default") or "")
        for child in element:
            if child.tag == "attribute":
                self.add(f"{path}/@{child.get('name')}", child.get("type"), child.get("default"))
            elif child.tag == "include":
                if child.get("filename") not in parents:  # models in models, and the like
                    self.read_file(child.get("filename"), path, parents)
            elif child.tag == "element" and child.get("ref"):
                self.add(f"{path}/{child.get('name')}")
            elif child.tag == "element" and child.get("name"):
                self.read(child, path, parents)
        for text in ADDED.get(name, []) if len(parents) else []:
            self.read_added(text, path, parents)

    def read_added(self, text, path, parents):
        at, _, kind = text.partition("=")
        if kind.endswith(".sdf"):
            if kind not in parents:
                where = path if kind != "noise.sdf" else f"{path}/{at}"
                for step in range(1, at.count("/") + 2) if kind == "noise.sdf" else ():
                    self.add("/".join([path, *at.split("/")[:step]]))
                self.read_file(kind, where, parents)
            return
        kind, _, default = kind.partition(":")
        steps = at.split("/")
        for i in range(1, len(steps)):
            self.add("/".join([path, *steps[:i]]))
        self.add(f"{path}/{at}", kind, default)


def with_new_states(rows):
    found = dict(rows)
    for path, row in rows.items():
        if not path.startswith("world/state/") or "/insertions" in path:
            continue
        steps = path.split("/")
        renamed = [steps[0], steps[1]] + [STATES.get(step, step) for step in steps[2:]]
        if "joint" not in steps:
            found.setdefault("/".join(renamed), row)
    for path in ("world/state/model_state/joint_state", "world/state/joint_state"):
        found[path] = ("", "")
        for part in JOINT_STATE:
            at, _, kind = part.partition("=")
            kind, _, default = kind.partition(":")
            found.setdefault(f"{path}/{at.split('/')[0]}", ("", ""))
            found[f"{path}/{at}"] = (kind, default)
    return found


def read_version(folder):
    reader = Reader(folder)
    reader.read_file("world.sdf", "", ())
    return with_new_states(reader.rows)


def children_of(rows, children):
    for path in rows:
        steps = path.split("/")
        if not steps[-1].startswith("@") and len(steps) > 1:
            children.setdefault(steps[-2], set()).add(steps[-1])


def main():
    source, root = Path(__file__).parents[2], Path(sys.argv[1])
    rows = read_version(root / "1.9")
    lines = ["# Every element and attribute of SDF 1.12, by sdf_elements.py: PATH|TYPE|DEFAULT"]
    for path, (kind, default) in sorted(rows.items()):
        lines.append(f"{path}|{kind}|{default}".replace("__default__", ""))
    (source / "tests/run/sdf_elements.txt").write_text("\n".join(lines) + "\n")
    children = {}
    for version in ("1.4", "1.5", "1.6", "1.7", "1.8", "1.9"):
        children_of(read_version(root / version), children)
    lines = ["// Made by tests/run/sdf_elements.py: an element of SDF, and what may stand in it."]
    for parent, names in sorted(children.items()):
        lines.append(f'{{"{parent}",')
        text = " ".join(sorted(names))
        while text:
            end = len(text) if len(text) <= 84 else text.rindex(" ", 0, 84) + 1
            lines.append(f' "{text[:end]}"')
            text = text[end:]
        lines[-1] += "},"
    (source / "src/world/read/sdf_children.inc").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
