"""The walls between the layers, and between the modules of the Python client; run by pytest.

The layers and what each may use are read from the ruedo_layer() lines of the top CMakeLists.txt, so
that there is one list. Libraries that live in one layer alone are listed below. The rules are also
run on small trees that break them.
"""

import ast
import html
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

# Libraries that only some layers may use: what an include of one begins with, and these layers.
LIBRARIES = {
    "Bullet": (
        ("btBullet", "bullet/", "LinearMath/", "BulletCollision/", "BulletDynamics/"),
        {"physics", "world/convex"},
    ),
    "Embree": (("embree3/", "embree4/"), {"scene"}),
    "OpenGL": (("GL/", "EGL/"), {"scene"}),
    "tinyxml2": (("tinyxml2",), {"world"}),
    "urdfdom": (("urdf_", "urdf/"), {"world"}),
    "yaml-cpp": (("yaml-cpp/",), {"world"}),
    "assimp": (("assimp/",), {"world"}),
    "libsdformat": (("sdf/",), set()),
    "LCM's network": (("lcm/lcm.h", "lcm/lcm-cpp", "lcm/eventlog"), {"bus"}),
    "CLI11": (("CLI/",), {"cli", "bench"}),
    "libwebsockets": (("libwebsockets",), {"http"}),
    "libseccomp": (("seccomp",), {"system"}),
    "Cyclone DDS": (("dds/dds.h", "dds/ddsi"), {"bridges/dds"}),
    "oneTBB": (("tbb/", "oneapi/tbb"), {"scene", "sensors", "engine"}),
}


# The rooms of a layer, from the lowest up: a room may include those before it.
# Files that lie in no room are above all.
ROOMS = {
    "world": (
        "document",
        "convex",
        "model",
        "mesh",
        "read",
        "maps",
        "compat",
        "drives",
        "urdf",
        "edit",
        "sdf",
    ),
    "physics": ("base", "collision", "joints", "dynamics", "bodies"),
}


def layers(root):
    """{layer: the layers it may include, itself among them}, from CMakeLists.txt. A layer is a
    folder below src/, such as "bridges/ros2". The command line may include all of them, and the
    benchmarks the command line, too, since they are commands.
    """
    text = (root / "CMakeLists.txt").read_text(encoding="utf-8")
    found = {}
    for path, links in re.findall(r"^\s*ruedo_layer\(([\w/]+)([^)]*)\)", text, re.MULTILINE):
        linked = set(re.findall(r"\bruedo_(\w+)", links))
        below = [layer for layer in found if layer.split("/")[-1] in linked]
        found[path] = {path}.union(*(found[layer] for layer in below))
    found["cli"] = {"cli", *found}
    found["bench"] = {"bench", *found}
    return found


def layer_of(path, known):
    """The layer of a file below src/: the innermost, where one lies in another; "" for none."""
    return max((layer for layer in known if path.startswith(layer + "/")), key=len, default="")


def includes(path):
    """(line number, included name) of each #include."""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        match = re.match(r'\s*#\s*include\s*[<"]([^>"]+)[>"]', line)
        if match:
            yield number, match.group(1)


def broken_walls(root):
    known = layers(root)
    folders = {layer.split("/")[0] for layer in known}
    problems = []
    for path in sorted(
        p
        for top in ("src", "include")
        for p in (root / top).rglob("*")
        if p.suffix in (".cpp", ".h")
    ):
        relative = path.relative_to(root)
        layer = "include/ruedo"
        if relative.parts[0] == "src":
            layer = layer_of(Path(*relative.parts[1:]).as_posix(), known)
        if not layer:
            problems.append(
                f"{relative}: no layer: its folder has no ruedo_layer() in CMakeLists.txt"
            )
            continue
        for number, name in includes(path):
            ours = "/" in name and name.split("/")[0] in folders
            if ours and layer_of(name, known) not in known.get(layer, set()):
                problems.append(f"{relative}:{number}: {layer} may not include {name}")
            for prefixes, homes in LIBRARIES.values():
                if name.startswith(prefixes) and layer not in homes:
                    problems.append(
                        f"{relative}:{number}: {name} belongs to {', '.join(sorted(homes))}, not to {layer}"
                    )
    return problems


def broken_rooms(root):
    """Includes from a room of ROOMS of one that is above it."""
    problems = []
    for layer, rooms in ROOMS.items():
        for path in sorted((root / "src" / layer).rglob("*")):
            room = path.relative_to(root / "src" / layer).parts[0]
            if path.suffix not in (".cpp", ".h") or path.parent.name == layer:
                continue
            if room not in rooms:
                problems.append(f"{path.relative_to(root)}: {room} is not in ROOMS")
                continue
            for number, name in includes(path):
                parts = name.split("/")
                if parts[0] != layer:
                    continue
                if len(parts) == 2 or rooms.index(parts[1]) > rooms.index(room):
                    problems.append(
                        f"{path.relative_to(root)}:{number}: {room} may not include {name}"
                    )
    return problems


MOST_FILES = 40  # of a folder that can still be read through
MAY_BE_FULL = {
    "src/sensors",  # one file for each sensor
    "clients/java/src/ruedo",  # a package of Java is one folder
    "proto",  # one file for each message
}


def full_folders(root):
    """Folders with more files than a reader can look through."""
    problems = []
    for top in ("src", "include", "clients", "tests", "proto", "web/src", "scripts", "cmake"):
        for folder in sorted((root / top).rglob("")):
            name = folder.relative_to(root).as_posix()
            if name in MAY_BE_FULL or "node_modules" in folder.parts:
                continue
            count = sum(1 for file in folder.iterdir() if file.is_file())
            if count > MOST_FILES:
                problems.append(f"{name}: {count} files; at most {MOST_FILES}: make rooms of it")
    return problems


WHOLE = "src/base/whole.h"  # the one way from a floating-point number to a whole one
INTEGER = r"(?:std::)?(?:u?int(?:8|16|32|64)?(?:_t)?|size_t|ptrdiff_t|unsigned(?: int| char)?|(?:unsigned )?long(?: long)?|SimTime|char)"
FLOATING = re.compile(
    r"\b(?:floor|ceil|round|trunc|sqrt|hypot|a?sin|a?cos|a?tan2?|exp2?|log2?|pow|fmod|norm|M_PI|double|float)\b(?!>)|"
    r"\bas_number\(|[.>]number\(|(?<![\w.])\d+\.\d*|(?<![\w.])\d+e\d|\b\w+_(?:s|m|hz|rad|kg)\b(?!\()"
)


def argument(text, begin):
    """What stands between the parenthesis that opens at `begin` and the one that closes it."""
    depth = 0
    for at in range(begin, len(text)):
        depth += {"(": 1, ")": -1}.get(text[at], 0)
        if depth == 0:
            return text[begin + 1 : at]
    return text[begin + 1 :]


def without_calls(text):
    """The expression, without what goes into functions that give something else: the size of a
    list, an element of it.
    """
    call = re.compile(r"[\w.:>-]*(?:<\w+>)?\((?:[^()]|\([^()]*\))*\)")
    return call.sub(
        lambda match: match.group(0) if FLOATING.search(match.group(0).split("(")[0]) else "f", text
    )


def bare_conversions(root):
    """Casts of floating-point numbers to whole ones: undefined for what does not fit, which
    base/whole.h refuses.
    """
    problems = []
    for path in sorted(
        p
        for top in ("src", "include")
        for p in (root / top).rglob("*")
        if p.suffix in (".cpp", ".h")
    ):
        relative = path.relative_to(root)
        if str(relative) == WHOLE:
            continue
        text = re.sub(r"//[^\n]*", "", path.read_text(encoding="utf-8"))
        found = [(m.start(), m.group(0)) for m in re.finditer(r"\bl?l(?:round|rint)[fl]?\(", text)]
        for match in re.finditer(rf"\bstatic_cast<{INTEGER}>\(|\b{INTEGER}\(", text):
            inside = argument(text, match.end() - 1)
            if FLOATING.search(
                without_calls(re.sub(r"static_cast<(?:double|float)>", "double", inside))
            ):
                found.append((match.start(), match.group(0) + inside[:40]))
        problems += [
            f"{relative}:{text.count(chr(10), 0, at) + 1}: {what.splitlines()[0]}: use {WHOLE}"
            for at, what in found
        ]
    return problems


INPUT = "src/base/input_file.cpp"
OPENED = re.compile(
    r"\bstd::ifstream\b(?!\s+\w+\(\"/proc/)|\bf(?:re)?open\([^;]*\"r|::open\((?:[^;](?!O_DIRECTORY))*O_RDONLY\b(?![^;]*O_DIRECTORY)"
)
OF_THE_KERNEL = {"src/bus/udp_sockets.cpp", "src/bus/lcm_url.cpp"}  # what they read is in /proc


def bare_reads(root):
    """Files that are opened to be read elsewhere than in base/input_file.h: a FIFO would stall
    them, a device feed them for ever.
    """
    return [
        f"{path.relative_to(root)}:{text.count(chr(10), 0, match.start()) + 1}: use {INPUT}"
        for path in sorted((root / "src").rglob("*.cpp"))
        if path.relative_to(root).as_posix() not in {INPUT, *OF_THE_KERNEL}
        for text in [re.sub(r"//[^\n]*", "", path.read_text(encoding="utf-8"))]
        for match in OPENED.finditer(text)
    ]


OUTPUT = "src/system/output_file.h"
WRITTEN = re.compile(r"\bstd::ofstream\b|\bfopen\([^;]*\"[wa]")
# Files that grow piece by piece.
STREAMED = {
    "src/bridges/ros2/bag/bag_log.cpp",
    "src/log/mcap_writer.cpp",
    "src/console/log_page.cpp",
}


def bare_writes(root):
    """Files that are written elsewhere than in system/output_file.h: a full disk would leave half
    of one in place of the old one.
    """
    return [
        f"{path.relative_to(root)}:{text.count(chr(10), 0, match.start()) + 1}: use {OUTPUT}"
        for path in sorted((root / "src").rglob("*.cpp"))
        if path.relative_to(root).as_posix() not in STREAMED
        for text in [re.sub(r"//[^\n]*", "", path.read_text(encoding="utf-8"))]
        for match in WRITTEN.finditer(text)
    ]


ERRORS = "src/system/to_stderr.h"


def bare_errors(root):
    """Messages that are printed elsewhere than in system/to_stderr.h: fmt throws where standard
    error is a file on a full disk, and a command that had its result ends otherwise.
    """
    return [
        f"{path.relative_to(root)}:{text.count(chr(10), 0, match.start()) + 1}: use {ERRORS}"
        for path in sorted((root / "src").rglob("*.cpp"))
        for text in [re.sub(r"//[^\n]*", "", path.read_text(encoding="utf-8"))]
        for match in re.finditer(r"\bfmt::print(?:ln)?\(\s*stderr\b", text)
    ]


def raw_errors(root):
    """Texts of others that to_stderr() prints as they are, escape codes and line ends included,
    because they come as a `const char*`: a std::string becomes one harmless line.
    """
    harmless = re.compile(r"std::string\((?:[^()]|\(\))*\)|for_terminal\([^()]*\)\.c_str\(\)")
    return [
        f"{path.relative_to(root)}:{text.count(chr(10), 0, match.start()) + 1}: pass a std::string"
        for path in sorted((root / "src").rglob("*.cpp"))
        for text in [re.sub(r"//[^\n]*", "", path.read_text(encoding="utf-8"))]
        for match in re.finditer(r"\bto_stderr\(", text)
        if re.search(
            r"(?:\.|->)(?:what|c_str|data)\(\)", harmless.sub("", argument(text, match.end() - 1))
        )
    ]


PYTHON_CLIENT = "clients/python/ruedo"
OTHERS_PRIVATE = {
    "_get_packed_fingerprint",  # of the classes that lcm-gen makes: it has no other name
    "_current_frames",  # of sys, documented under this name alone
    "_exit",  # of os, likewise
}


def dangling_ranges(root):
    """Loops over what a temporary pointer owns: `for (x : make()->list)`. C++20 destroys the
    pointer before the first turn.
    """
    problems = []
    for path in sorted(
        p
        for top in ("src", "include", "clients/cpp", "clients/python/engine", "tests")
        for p in (root / top).rglob("*")
        if p.suffix in (".cpp", ".h")
    ):
        text = re.sub(r"//[^\n]*", "", path.read_text(encoding="utf-8"))
        for match in re.finditer(r"\bfor \(", text):
            inside = argument(text, match.end() - 1)
            colon = re.search(r"(?<!:):(?!:)", inside)
            if ";" in inside or not colon:
                continue
            owner = re.search(r"(\w+)(<[^()]*>)?\([^()]*\)->", inside[colon.end() :])
            if owner and owner.group(1) != "static_cast":
                line = text.count("\n", 0, match.start()) + 1
                problems.append(
                    f"{path.relative_to(root)}:{line}: name what {owner.group(1)}() returns"
                )
    return problems


def is_private(name):
    return name.startswith("_") and not name.endswith("__")


def own_members(tree):
    """The private members that a module's classes define or assign, without overrides, which call
    what they override.
    """
    found, overrides = set(), set()
    for node in (
        n for top in ast.walk(tree) if isinstance(top, ast.ClassDef) for n in ast.walk(top)
    ):
        owner = ast.unparse(node.value) if isinstance(node, ast.Attribute) else ""
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            found.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.add(node.id)
        elif owner in ("self", "cls") and isinstance(node.ctx, ast.Store):
            found.add(node.attr)
        elif owner == "super()":
            overrides.add(node.attr)
    return {name for name in found - overrides if is_private(name)}


def foreign_members(root):
    """Private members of the Python client that are used outside of the module that defines them.

    An object's class is not known here. So a private name that is used on another object than self
    must be a member of this module's classes and of no other module's.
    """
    modules = {
        path: ast.parse(path.read_text(encoding="utf-8"))
        for path in sorted((root / PYTHON_CLIENT).rglob("*.py"))
        if "lcmtypes" not in path.parts
    }
    members = {path: own_members(tree) for path, tree in modules.items()}
    problems = []
    for path, tree in modules.items():
        others = set().union(*(names for other, names in members.items() if other != path))
        for node in ast.walk(tree):
            used = ""
            if isinstance(node, ast.Attribute):
                if ast.unparse(node.value) not in ("self", "cls", "super()"):
                    used = node.attr
            elif isinstance(node, ast.Call) and ast.unparse(node.func) in ("getattr", "setattr"):
                name = node.args[1]
                used = name.value if isinstance(name, ast.Constant) else ""
            elif isinstance(node, ast.ImportFrom) and node.module:
                used = next((one.name for one in node.names if is_private(one.name)), "")
            if not is_private(used) or used in OTHERS_PRIVATE | (members[path] - others):
                continue
            problems.append(
                f"{path.relative_to(root)}:{node.lineno}: {ast.unparse(node)}: {used} is another module's own"
            )
    return problems


def states_left_behind(root):
    """Sensors of which a snapshot would not have the state: SensorOf copies it. Those that draw
    pictures have none.
    """
    problems = []
    for path in sorted((root / "src").rglob("*.cpp")):
        text = path.read_text(encoding="utf-8")
        if ".needs_renderer = true" in text or path.name == "plugin_guard.cpp":  # passes it on
            continue
        problems += [
            f"{path.relative_to(root)}: {name} is a Sensor, but no SensorOf<{name}>"
            for name, base in re.findall(r"class (\w+)[^;{]*: public (Sensor\w*(?:<\w+>)?)", text)
            if base not in (f"SensorOf<{name}>",) and base.startswith("Sensor")
        ]
    return problems


WEB = "web/src"
# The layers of the console's page, folders or single files, and what each may import beside itself.
WEB_LAYERS = {
    "wire": set(),
    "widgets": set(),
    "state": {"wire"},
    "control": {"state", "widgets", "wire"},
    "scene": {"state", "widgets", "wire"},
    "edit": {"control", "scene", "state", "widgets", "wire"},
    "ui": {"edit", "scene", "state", "widgets", "wire"},
    "app": {"control", "edit", "scene", "state", "ui", "widgets", "wire"},
    "main": {"app", "state"},
}
MOST_LINES_OF_APP = 250  # a module that knows many others is a short one


def web_imports(root):
    """{module: the modules of the page that it imports, types too}, both by their paths without
    ".ts".
    """
    found = {}
    for path in sorted((root / WEB).rglob("*.ts")):
        text = path.read_text(encoding="utf-8")
        names = re.findall(r'^(?:import|export)\b[^;"]*?from "(\.[^"]+)"', text, re.MULTILINE)
        targets = {(path.parent / name).resolve() for name in names}
        base = (root / WEB).resolve()
        found[path.relative_to(root / WEB).with_suffix("").as_posix()] = {
            target.relative_to(base).as_posix() for target in targets if base in target.parents
        }
    return found


def circles(imports):
    """Each circle of imports once, as its modules in the order of the import."""
    found, done = [], set()

    def walk(module, path):
        if module in path:
            found.append([*path[path.index(module) :], module])
        elif module not in done:
            for target in sorted(imports.get(module, ())):
                walk(target, [*path, module])
            done.add(module)

    for module in imports:
        walk(module, [])
    return found


# The packages of the Python client, and which others each may import; "" are the modules outside of
# all. The client never imports the packages that build on it.
PYTHON_PACKAGES = {
    "": {"transport", "session"},
    "transport": {""},
    "session": {"", "transport"},
    "campaign": {""},
    "hunt": {"", "campaign"},
    "gym": {""},
    "fit": {""},
}


def python_imports(root):
    """{module: the modules that it imports when it is loaded, or for its types}, as dotted names
    below the client's package.
    """
    client = root / PYTHON_CLIENT
    names = {
        path: ".".join(path.relative_to(client).with_suffix("").parts).removesuffix(".__init__")
        for path in sorted(client.rglob("*.py"))
    }
    found = {}
    for path, module in names.items():
        package = path.relative_to(client).parent.parts
        outside, targets = [ast.parse(path.read_text(encoding="utf-8"))], set()
        while outside:
            for node in ast.iter_child_nodes(outside.pop()):
                if isinstance(node, ast.ImportFrom) and node.level:
                    base = [*package[: len(package) - node.level + 1]]
                    base += node.module.split(".") if node.module else []
                    whole = ".".join(base)
                    each = {".".join([*base, one.name]) for one in node.names}
                    targets |= (each & set(names.values())) or {whole}
                elif not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                    outside.append(node)
        found[module] = {t for t in targets if t in names.values()} - {module, "__init__"}
    return found


def broken_python_walls(root):
    """Modules of the Python client that import one another in a circle, or a package beyond those
    that PYTHON_PACKAGES allows.
    """
    imports = python_imports(root)
    problems = [f"{PYTHON_CLIENT}: a circle: {' -> '.join(circle)}" for circle in circles(imports)]

    def package_of(module):
        head, _, rest = module.partition(".")
        return head if rest or head in PYTHON_PACKAGES else ""

    for module, targets in imports.items():
        if module == "__init__":
            continue
        own = package_of(module)
        problems += [
            f"{PYTHON_CLIENT}/{module}: may not import {target}"
            for target in sorted(targets)
            if package_of(target) not in PYTHON_PACKAGES[own] | {own}
        ]
    return problems


def broken_web_walls(root):
    """The page's modules import those of the layers below alone, none in a circle; and a view is
    used by one module: by the page, or by the view that it is a part of.
    """
    imports = web_imports(root)
    problems = [f"{WEB}: a circle: {' -> '.join(circle)}" for circle in circles(imports)]
    for module, targets in imports.items():
        layer = module.split("/")[0]
        if layer not in WEB_LAYERS:
            problems.append(f"{WEB}/{module}.ts: {layer} is not a layer of the page")
            continue
        for target in sorted(targets):
            below = target.split("/")[0]
            if below != layer and below not in WEB_LAYERS[layer]:
                problems.append(f"{WEB}/{module}.ts: {layer} may not import {target}")
        lines = len((root / WEB / f"{module}.ts").read_text(encoding="utf-8").splitlines())
        if layer == "app" and lines > MOST_LINES_OF_APP:
            problems.append(f"{WEB}/{module}.ts: {lines} lines, of {MOST_LINES_OF_APP}")
    for view in (module for module in imports if module.startswith("ui/")):
        users = sorted(module for module, targets in imports.items() if view in targets)
        inside = [user for user in users if user.startswith("ui/")]
        if len(inside) > 1 or (inside and len(users) > len(inside)):
            problems.append(f"{WEB}/{view}.ts is a part of more than one: {', '.join(users)}")
    return problems


@pytest.mark.parametrize(
    "rule",
    [
        broken_walls,
        broken_rooms,
        full_folders,
        bare_conversions,
        bare_reads,
        bare_writes,
        bare_errors,
        raw_errors,
        dangling_ranges,
        foreign_members,
        states_left_behind,
        broken_web_walls,
        broken_python_walls,
    ],
)
def test_tree_keeps(rule):
    problems = rule(ROOT)
    assert not problems, "\n" + "\n".join(problems)


def test_layers_are_those_of_the_design():
    known = layers(ROOT)
    assert list(known) == [
        "base",
        "system",
        "http",
        "world/convex",
        "world",
        "scene",
        "physics",
        "robot",
        "sensors",
        "engine/judge",
        "engine",
        "log",
        "bus",
        "run",
        "bridges/ros2",
        "bridges/dds",
        "bridges/foxglove",
        "console",
        "report",
        "cli",
        "bench",
    ]
    assert known["base"] == {"base"} and known["system"] == {"base", "system"}
    assert known["http"] == {"base", "system", "http"}
    for outsider in ("physics", "engine", "run", "bus", "robot"):
        assert outsider not in known["sensors"]
    # One world knows no log, no network and no pace.
    assert not known["engine"] & {"log", "run", "bus", "http", "console"}
    assert not known["log"] & {"engine", "run", "bus"}
    # The judge asks physics for distances between shapes, and moves nothing.
    assert not known["engine/judge"] & {"engine", "run", "bus", "log", "robot", "scene"}
    assert "run" not in known["bus"] and "scene" not in known["physics"]
    assert not known["report"] & {"cli", "console", "bus"}


def test_every_room_says_what_it_is_for():
    rooms = {path.parent for path in (ROOT / "src").rglob("*.cpp")}
    for room in sorted(rooms - {ROOT / "src/base/math"}):
        text = (room / "README.md").read_text(encoding="utf-8").splitlines()
        assert 3 <= len(text) <= 15, room
        for link in re.findall(r"\]\(([^)]+)\)", "\n".join(text)):
            assert (room / link).exists(), f"{room}: {link}"


def test_the_walks_name_functions_that_are_there():
    page = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    steps = re.findall(r"\| `([\w:]+)` in `([\w/.]+)` \|", page)
    assert len(steps) > 15
    for function, path in steps:
        text = (ROOT / path).read_text(encoding="utf-8")
        assert re.search(rf"\b{function}\(", text), f"{path} does not define {function}"


def test_the_map_is_that_of_the_layers():
    sys.path.insert(0, str(ROOT / "scripts"))
    import draw_layers

    known = layers(ROOT)
    page = (ROOT / draw_layers.PAGE).read_text(encoding="utf-8")
    assert draw_layers.with_tables(page, ROOT) == page, "run scripts/draw_layers.py"
    picture = (ROOT / draw_layers.PICTURE).read_text(encoding="utf-8")
    drawn = [html.unescape(one) for one in re.findall(r"<title>(.*?)</title>", picture)]
    arrows = {f"{layer}->{other}" for layer, other in draw_layers.arrows(known)}
    assert set(drawn) == {"layers", *known, *arrows}, "run scripts/draw_layers.py"
    lines = [html.unescape(one) for one in re.findall(r"<text .*?>(.*?)</text>", picture)]
    for layer in known:
        text = draw_layers.purpose(ROOT, layer).rstrip(".")
        assert text in " ".join(lines[lines.index(layer) :]), "run scripts/draw_layers.py"


# Elementary functions: ours alone, since the C library's depend on the CPU (include/ruedo/math.h).
MATH = set(
    re.search(
        r"set\(RUEDO_MATH_FUNCTIONS ([^)]*)\)",
        (ROOT / "cmake/RuedoMath.cmake").read_text(encoding="utf-8"),
    )
    .group(1)
    .split()
)
NOT_OURS = MATH | {
    "log2",
    "log1p",
    "sinh",
    "cosh",
    "tanh",
    "asinh",
    "acosh",
    "atanh",
    "cbrt",
    "erf",
    "erfc",
    "lgamma",
    "tgamma",
    "polar",
    "arg",
}


def foreign_math(root):
    call = re.compile(r"(?:std::|(?<![\w:.>\"]))(" + "|".join(sorted(NOT_OURS)) + r")[fl]?\(")
    problems = []
    for path in sorted(
        p
        for top in ("src", "include")
        for p in (root / top).rglob("*")
        if p.suffix in (".cpp", ".h")
    ):
        if path.relative_to(root).as_posix() in (
            "include/ruedo/math.h",
            "src/base/math/c_names.cpp",
        ):
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            code = re.sub(r'"(?:[^"\\]|\\.)*"|//.*', "", line)
            declared = re.search(
                r"\b(?:void|Log|Logger|MotionLog&?|Reader)\s+(?:log)\(|\bSineCosine\s+sincos\(",
                code,
            )
            problems += [
                f"{path.relative_to(root)}:{number}: {name}() is the C library's; use math::{name} of ruedo/math.h"
                for name in call.findall(code)
                if not declared
            ]
    return problems


def test_elementary_functions_are_ours():
    problems = foreign_math(ROOT)
    assert not problems, "\n" + "\n".join(problems)


def test_a_foreign_function_is_reported(tmp_path):
    (tmp_path / "src/robot").mkdir(parents=True)
    (tmp_path / "include").mkdir()
    (tmp_path / "src/robot/a.cpp").write_text(
        "// sin(x)\ndouble a = std::sin(1.0), b = math::cos(2.0);\nfloat c = atan2f(1, 2) + std::log2(3);\n"
    )
    assert [p.split(": ")[0] + p.split(": ")[1][:5] for p in foreign_math(tmp_path)] == [
        "src/robot/a.cpp:2sin()",
        "src/robot/a.cpp:3atan2",
        "src/robot/a.cpp:3log2(",
    ]


@pytest.mark.skipif("RUEDO_BINARY_DIR" not in os.environ, reason="started without a build")
def test_binaries_import_no_elementary_function():
    build = Path(os.environ["RUEDO_BINARY_DIR"])
    built = [
        build / "bin/ruedo",
        build / "bin/ruedo-import-mesh",
        *build.glob("python/ruedo/_engine*.so"),
        *build.glob("math/lib*.so*"),
    ]
    assert len(built) >= 8
    for path in built:
        names = subprocess.run(
            ["nm", "-D", "--undefined-only", path], capture_output=True, text=True, check=True
        ).stdout.split()
        foreign = {name.split("@")[0] for name in names} & NOT_OURS
        assert not foreign, f"{path.name} takes {', '.join(sorted(foreign))} from the C library"


# The rules themselves, on trees that break them.


def tree(folder, files):
    (folder / "CMakeLists.txt").write_text(
        "ruedo_layer(base LINK Eigen3::Eigen)\nruedo_layer(scene LINK ruedo_base)\n"
        "ruedo_layer(physics LINK ruedo_base)\nruedo_layer(sensors LINK ruedo_scene)\n"
        "ruedo_layer(engine/judge LINK ruedo_scene)\nruedo_layer(engine LINK ruedo_physics)\n"
        "ruedo_layer(bridges/ros2 LINK ruedo_engine)\n"
    )
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


@pytest.mark.parametrize(
    "name, include, good",
    [
        ("src/sensors/lrf.cpp", '"scene/rays/ray_scene.h"', True),
        ("src/sensors/lrf.cpp", '"base/x.h"', True),
        ("src/sensors/lrf.cpp", '"physics/physics_world.h"', False),
        ("src/scene/ray.cpp", '"sensors/lrf.h"', False),
        ("src/scene/ray.cpp", "<embree4/rtcore.h>", True),
        ("src/sensors/lrf.cpp", "<embree4/rtcore.h>", False),
        ("src/physics/world.cpp", "<btBulletDynamicsCommon.h>", True),
        ("src/scene/ray.cpp", "<btBulletDynamicsCommon.h>", False),
        ("src/cli/main.cpp", '"sensors/lrf.h"', True),
        ("src/cli/commands/run.cpp", '"bridges/ros2/node.h"', True),
        ("src/cli/main.cpp", '"bench/bench.h"', False),
        ("src/bench/bench.cpp", '"cli/support/range.h"', True),
        ("src/physics/joints/block.cpp", '"physics/base/rows.h"', True),
        ("src/physics/joints/block.cpp", '"scene/rays/ray_scene.h"', False),
        ("src/engine/judge/judge.cpp", '"scene/rays/ray_scene.h"', True),
        ("src/engine/judge/judge.cpp", '"physics/world.h"', False),
        ("src/engine/judge/judge.cpp", '"engine/world.h"', False),
        ("src/engine/world.cpp", '"engine/judge/judge.h"', False),
        ("src/engine/edits/edits.cpp", '"engine/world.h"', True),
        ("src/bridges/ros2/node.cpp", '"engine/edits/edits.h"', True),
        ("src/engine/world.cpp", '"bridges/ros2/node.h"', False),
        ("src/bridges/lost.cpp", '"base/x.h"', False),
        ("src/bridges/ros2/node.cpp", '"bridges/lost.h"', False),
        ("src/lost.cpp", '"base/x.h"', False),
        ("include/ruedo/pose.h", "<Eigen/Geometry>", True),
        ("include/ruedo/pose.h", '"base/x.h"', False),
        ("src/newlayer/x.cpp", '"base/x.h"', False),
    ],
)
def test_walls_are_seen(tmp_path, name, include, good):
    assert (
        broken_walls(tree(tmp_path, {name: f"#pragma once\n#include {include}\n"})) == []
    ) == good


@pytest.mark.parametrize(
    "name, include, good",
    [
        ("src/world/sdf/sdf_model.cpp", '"world/compat/plugins.h"', True),
        ("src/world/read/frames.cpp", '"world/model/world_model.h"', True),
        ("src/world/model/ground.cpp", '"world/read/read_context.h"', False),
        ("src/world/urdf/urdf.cpp", '"world/sdf/sdf_link.h"', False),
        ("src/world/sdf/sdf_world.cpp", '"world/load.h"', False),
        ("src/world/load.cpp", '"world/sdf/sdf_reader.h"', True),
        ("src/world/cellar/x.cpp", '"world/model/world_model.h"', False),
        ("src/physics/joints/joint_tree.cpp", '"physics/dynamics/solver.h"', False),
        ("src/physics/bodies/joints.cpp", '"physics/joints/joint_block.h"', True),
    ],
)
def test_walls_of_rooms_are_seen(tmp_path, name, include, good):
    assert (
        broken_rooms(tree(tmp_path, {name: f"#pragma once\n#include {include}\n"})) == []
    ) == good


def test_full_folders_are_seen(tmp_path):
    files = {f"src/base/f{i}.cpp": "" for i in range(MOST_FILES + 1)}
    assert full_folders(tree(tmp_path, files))
    del files["src/base/f0.cpp"]
    (tmp_path / "other").mkdir()
    assert not full_folders(tree(tmp_path / "other", files))


@pytest.mark.parametrize(
    "text, good",
    [
        ("int64_t n = std::llround(x);", False),
        ("auto n = static_cast<int64_t>(std::floor(x / cell));", False),
        ("auto n = static_cast<int>(phase_s);", False),
        ("auto n = static_cast<size_t>(2 * static_cast<double>(i));", False),
        ("auto n = int64_t(e.number(path, 0) * 1e6);", False),
        ("auto n = static_cast<int>(i);", True),
        ("auto n = static_cast<size_t>(list[static_cast<size_t>(i)].size());", True),
        ("auto n = whole<int>(phase_s);", True),
        ("auto n = static_cast<int64_t>(sizeof(double));", True),
    ],
)
def test_bare_conversions_are_seen(tmp_path, text, good):
    assert (
        bare_conversions(
            tree(
                tmp_path,
                {"src/base/a.cpp": text + "\n", WHOLE: "static_cast<int>(std::floor(x))\n"},
            )
        )
        == []
    ) == good


@pytest.mark.parametrize(
    "text, good",
    [
        ("std::ifstream file(path);", False),
        ('std::FILE* file = std::fopen(path.c_str(), "rb");', False),
        ("const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);", False),
        ('std::ifstream file("/proc/net/tcp");', True),
        ('std::FILE* file = std::fopen(path.c_str(), "wb");', True),
        ("const int folder = ::open(path.c_str(), O_RDONLY | O_DIRECTORY);", True),
        ("const int file = ::open(path.c_str(), O_WRONLY | O_CREAT, 0666);", True),
    ],
)
def test_bare_reads_are_seen(tmp_path, text, good):
    assert (bare_reads(tree(tmp_path, {"src/base/a.cpp": text + "\n"})) == []) == good


@pytest.mark.parametrize(
    "text, good",
    [
        ('fmt::print(stderr, "{}", a);', False),
        ('fmt::print(\n    stderr, "a");', False),
        ('fmt::print("{}", stderr_text);', True),
        ('to_stderr("{}", a);', True),
    ],
)
def test_bare_errors_are_seen(tmp_path, text, good):
    assert (bare_errors(tree(tmp_path, {"src/cli/a.cpp": text + "\n"})) == []) == good


@pytest.mark.parametrize(
    "text, good",
    [
        ('to_stderr("{}\\n", error.what());', False),
        ('to_stderr("{}: {}\\n",\n  a, name.c_str());', False),
        ('to_stderr("{}\\n", std::string(error.what()));', True),
        ('to_stderr("{}\\n", for_terminal(lines).c_str());', True),
        ('to_stderr("{}{}\\n", style.red, error.message());', True),
    ],
)
def test_raw_errors_are_seen(tmp_path, text, good):
    assert (raw_errors(tree(tmp_path, {"src/cli/a.cpp": text + "\n"})) == []) == good


@pytest.mark.parametrize(
    "text, good",
    [
        ("for (const auto& x : make(a)->list) f(x);", False),
        ("for (const X& x :\n     core()->info()->robots)\n  f(x);", False),
        ("for (const auto& x : made->list) f(x);", True),
        ("for (const auto& x : make(a).list) f(x);", True),  # lives as long as the loop
        ("for (const P* p : static_cast<const B*>(b)->all) f(p);", True),
        ("for (int i = 0; i < make()->n; ++i) f(a ? i : 0);", True),
    ],
)
def test_dangling_ranges_are_seen(tmp_path, text, good):
    assert (dangling_ranges(tree(tmp_path, {"src/base/a.cpp": text + "\n"})) == []) == good


@pytest.mark.parametrize(
    "text, good",
    [
        ("class B:\n    def f(self): return self._own\n", True),
        ("class B:\n    _own: int\n    def f(self, other): return other._own\n", True),
        ("class B:\n    def _g(self): return super()._g()\n", True),
        ("FINGERPRINT = tick_t._get_packed_fingerprint()\n", True),
        ("from . import _engine\n", True),
        ("from ._version import __version__\n", True),
        ("class B:\n    def f(self): return self.a._info\n", False),
        ("class B:\n    def f(self): self._info = self.a._info\n", False),  # A has one, too
        ("def f(a): a._info = 1\n", False),
        ("def f(a): return getattr(a, '_info')\n", False),
        ("from .a import _helper\n", False),
        ("from . import a\na._helper()\n", False),
    ],
)
def test_members_of_other_modules_are_seen(tmp_path, text, good):
    client = tmp_path / PYTHON_CLIENT
    client.mkdir(parents=True)
    (client / "a.py").write_text(
        "class A:\n    def __init__(self): self._info = 0\ndef _helper(): pass\n"
    )
    (client / "b.py").write_text(text)
    assert (foreign_members(tmp_path) == []) == good


@pytest.mark.parametrize(
    "files, problem",
    [
        ({"ui/a": "../state/b", "state/b": ""}, None),
        ({"state/b": "../ui/a", "ui/a": ""}, "state may not import ui/a"),
        ({"ui/a": "./b", "ui/b": ""}, None),
        ({"ui/a": "./b", "ui/b": "", "ui/c": "./b"}, "more than one: ui/a, ui/c"),
        ({"ui/a": "./b", "ui/b": "", "app/c": "../ui/b"}, "more than one: app/c, ui/a"),
        ({"state/a": "./b", "state/b": "./a"}, "a circle: state/a -> state/b -> state/a"),
        ({"more/a": ""}, "more is not a layer"),
        ({"app/a": "", "app/long": "\n" * (MOST_LINES_OF_APP + 1)}, "251 lines"),
    ],
)
def test_walls_of_the_page_are_seen(tmp_path, files, problem):
    for name, target in files.items():
        path = tmp_path / WEB / f"{name}.ts"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(
            target if "\n" in target else f'import type {{\n  A,\n}} from "{target}";\n'
        )
    found = broken_web_walls(tmp_path)
    assert len(found) == (problem is not None) and all(problem in line for line in found)


@pytest.mark.parametrize(
    "files, problem",
    [
        ({"robot": "from .motion import Motion\n", "motion": ""}, ""),
        ({"motion": "from .robot import Robot\n", "robot": "from . import motion\n"}, "a circle"),
        (
            {
                "motion": "if TYPE_CHECKING:\n    from .robot import Robot\n",
                "robot": "from .motion import Motion\n",
            },
            "a circle",
        ),
        ({"launch": "def f():\n    from .campaign import cli\n", "campaign/cli": ""}, ""),
        ({"launch": "from .campaign import cli\n", "campaign/cli": ""}, "may not import"),
        ({"hunt/hunt": "from ..campaign.plan import Case\n", "campaign/plan": ""}, ""),
        ({"campaign/plan": "from ..hunt.hunt import Hunt\n", "hunt/hunt": ""}, "may not import"),
        ({"transport/bus": "from ..session.clock import Clock\n", "session/clock": ""}, "may not"),
    ],
)
def test_walls_of_the_python_client_are_seen(tmp_path, files, problem):
    for name, text in files.items():
        path = tmp_path / PYTHON_CLIENT / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    problems = "\n".join(broken_python_walls(tmp_path))
    assert problem in problems if problem else not problems
