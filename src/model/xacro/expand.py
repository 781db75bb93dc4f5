"""Expands a xacro file for Ruedo, by the Python package xacro, without ROS around it.

    expand.py FILE OUT [--folder FOLDER]... [--argument NAME:=VALUE]...

OUT gets the robot, each element with the attribute ruedo_at="FILE:LINE" that says where it was
written; OUT.files the files that were read, a line each; OUT.missing "FILE\tWHAT" for includes that
are not there and were passed over. $(find PKG) is the folder whose package.xml has that name: above
the file, beside its package, or in the folders given. Errors go to stderr, in one line; the exit
code is 1, or 2 where the package xacro is missing.
"""

import argparse
import contextlib
import os
import re
import sys
import types
import xml.dom.expatbuilder

MOST_FOLDERS = 2000  # that are looked at for packages


def package_name(folder):
    try:
        with open(
            os.path.join(folder, "package.xml"), encoding="utf-8", errors="replace"
        ) as manifest:
            found = re.search(r"<name>\s*([^<\s]+)\s*</name>", manifest.read(1 << 20))
    except OSError:
        return None
    return found.group(1) if found else None


def packages(roots):
    """{name: folder}; of two with one name the first."""
    known, looked = {}, 0
    for root, depth in roots:
        level = [root]
        for _ in range(depth + 1):
            below = []
            for folder in level:
                looked += 1
                if looked > MOST_FOLDERS:
                    return known
                name = package_name(folder)
                if name:
                    known.setdefault(name, folder)
                with contextlib.suppress(OSError):
                    below += sorted(
                        entry.path
                        for entry in os.scandir(folder)
                        if entry.is_dir() and not entry.name.startswith(".")
                    )
            level = below
    return known


def roots_of(file, folders):
    """Folders to search for packages, and how deep."""
    roots, folder = [], os.path.dirname(file)
    above = []
    while folder != os.path.dirname(folder):
        above.append(folder)
        folder = os.path.dirname(folder)
    for each in above:
        if os.path.exists(os.path.join(each, "package.xml")):
            roots += [(each, 0), (os.path.dirname(each), 1)]
    return roots + [(each, 2) for each in folders]


def note_lines(files):
    """Elements that come from a file say from which line."""
    builder = xml.dom.expatbuilder.ExpatBuilderNS
    plain = builder.start_element_handler

    def start_element_handler(self, name, attributes):
        plain(self, name, attributes)
        node = self.curNode
        if not node.tagName.startswith("xacro:"):
            node.setAttribute(
                "ruedo_at", f"{files[-1] if files else ''}:{self.getParser().CurrentLineNumber}"
            )

    builder.start_element_handler = start_element_handler


MISSING = "/package-not-found"  # the folder of a package that is not found


def as_written(text):
    return re.sub(MISSING + "/([^/ ']+)", r"$(find \1)", text)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("file")
    parser.add_argument("out")
    parser.add_argument("--folder", action="append", default=[])
    parser.add_argument("--argument", action="append", default=[])
    arguments = parser.parse_args()
    try:
        import xacro
    except ImportError:
        print(
            "the Python package xacro is missing: pip install xacro, beside Ruedo's Python client",
            file=sys.stderr,
        )
        return 2

    file = os.path.abspath(arguments.file)
    known = packages(roots_of(file, arguments.folder))

    def get_package_share_directory(name):
        if name in known:
            return known[name]
        return os.path.join(MISSING, name)

    index, inner = (
        types.ModuleType("ament_index_python"),
        types.ModuleType("ament_index_python.packages"),
    )
    inner.get_package_share_directory = get_package_share_directory
    index.packages = inner
    sys.modules.update({"ament_index_python": index, "ament_index_python.packages": inner})

    reading, read, missing = [], [], []
    note_lines(reading)
    parse, load_yaml, include = xacro.parse, xacro.load_yaml, xacro.process_include

    def noted_parse(inp, filename=None):
        if filename is None:
            return parse(inp)
        path = os.path.abspath(filename)
        reading.append(path)
        read.append(path)
        try:
            return parse(inp, filename)
        finally:
            reading.pop()

    def noted_yaml(filename):
        read.append(os.path.abspath(xacro.abs_filename_spec(filename)))
        return load_yaml(filename)

    def noted_include(elt, macros, symbols, func):
        name = xacro.eval_text(elt.getAttribute("filename"), symbols)
        path = xacro.abs_filename_spec(name)
        if not re.search(r"[*?\[]", path) and not os.path.exists(path):
            missing.append((xacro.filestack[-1] or file, as_written(name)))
            elt.setAttribute("optional", "true")
        return include(elt, macros, symbols, func)

    xacro.parse, xacro.process_include = noted_parse, noted_include
    if "load_yaml" in xacro._global_symbols.get("xacro", {}):
        xacro._global_symbols["xacro"]["load_yaml"] = noted_yaml
    try:
        document = xacro.process_file(
            file, mappings=dict(each.split(":=", 1) for each in arguments.argument)
        )
    except Exception as error:
        where = next(
            (os.path.abspath(each) for each in reversed(xacro.filestack or []) if each), file
        )
        text = as_written(" ".join(str(error).split())) or type(error).__name__
        lost = "; not found: " + ", ".join(sorted({name for _, name in missing})) if missing else ""
        print(f"{where}: {text}{lost}", file=sys.stderr)
        return 1
    with open(arguments.out, "w", encoding="utf-8") as out:
        # What is not found is named as other files have it.
        out.write(
            document.toxml()
            .replace("file://" + MISSING, MISSING)
            .replace(MISSING + "/", "package://")
        )
    with open(arguments.out + ".files", "w", encoding="utf-8") as out:
        out.writelines(f"{each}\n" for each in dict.fromkeys(read))
    with open(arguments.out + ".missing", "w", encoding="utf-8") as out:
        out.writelines(f"{where}\t{name}\n" for where, name in dict.fromkeys(missing))
    return 0


if __name__ == "__main__":
    sys.exit(main())
