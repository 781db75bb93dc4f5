"""Expands a xacro file for Ruedo, by the Python package xacro, without ROS around it.

    expand.py FILE [--folder FOLDER]... [--argument NAME:=VALUE]...
    expand.py --parts

Prints a line "read\tFILE" for each file that was read, and "missing\tFILE\tWHAT" for each
include that is not there and was passed over; after an empty line the robot, each element with the
attribute ruedo_at="FILE:LINE" that says where it was written. $(find PKG) is the folder whose
package.xml has that name: above the file, beside its package, or in the folders given; else a
folder of that name above the file.
Errors go to stderr, in one line; the exit code is 1, or 2 where the package xacro is missing.

A xacro file is a program: xacro lets any Python through. Run this in a sandbox. --parts prints the
interpreter and what it reads of its own, a path a line, for that.
"""

import argparse
import contextlib
import os
import re
import sys
import types
import xml.dom.expatbuilder

MOST_FOLDERS = 2000  # that are looked at for packages


def print_parts():
    print(sys.executable)
    for prefix in {sys.prefix, sys.exec_prefix, sys.base_prefix, sys.base_exec_prefix}:
        for part in ("lib", "lib64", "pyvenv.cfg"):
            print(os.path.join(prefix, part))
    for name in ("sitecustomize", "usercustomize"):
        if getattr(sys.modules.get(name), "__file__", None):
            print(sys.modules[name].__file__)
    print(*filter(None, sys.path), sep="\n")
    return 0


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
                    continue  # packages do not lie in one another
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


def folder_above(file, name):
    """A copied description without its package.xml is known by its folder's name."""
    folder, home = os.path.dirname(file), os.path.expanduser("~")
    while folder != os.path.dirname(folder):
        if os.path.basename(folder) == name and not f"{home}/".startswith(f"{folder}/"):
            return folder
        folder = os.path.dirname(folder)
    return None


def serve_packages(known, file):
    """Has xacro's $(find PKG) look there; ROS is not asked."""

    def get_package_share_directory(name):
        return known.get(name) or folder_above(file, name) or os.path.join(MISSING, name)

    index = types.ModuleType("ament_index_python")
    index.packages = types.ModuleType("ament_index_python.packages")
    index.packages.get_package_share_directory = get_package_share_directory
    sys.modules.update({index.__name__: index, index.packages.__name__: index.packages})


class Notes:
    """What xacro reads and what it does not find, by wrapping its functions."""

    def __init__(self, xacro, file):
        self.read, self.missing = [], []  # files; (file, the missing one)
        self._xacro, self._file = xacro, file
        self._reading = []  # files that are open, the innermost last
        self._parse, self._include = xacro.parse, xacro.process_include
        note_lines(self._reading)
        xacro.parse, xacro.process_include = self._noted_parse, self._noted_include
        functions = xacro._global_symbols.get("xacro", {})
        if "load_yaml" in functions:
            self._load_yaml, functions["load_yaml"] = xacro.load_yaml, self._noted_yaml

    def _noted_parse(self, inp, filename=None):
        if filename is None:
            return self._parse(inp)
        path = os.path.abspath(filename)
        self._reading.append(path)
        self.read.append(path)
        try:
            return self._parse(inp, filename)
        finally:
            self._reading.pop()

    def _noted_yaml(self, filename):
        self.read.append(os.path.abspath(self._xacro.abs_filename_spec(filename)))
        return self._load_yaml(filename)

    def _noted_include(self, elt, macros, symbols, func):
        name = self._xacro.eval_text(elt.getAttribute("filename"), symbols)
        path = self._xacro.abs_filename_spec(name)
        if not re.search(r"[*?\[]", path) and not os.path.exists(path):
            self.missing.append((self._xacro.filestack[-1] or self._file, as_written(name)))
            elt.setAttribute("optional", "true")
        return self._include(elt, macros, symbols, func)

    def fault(self, error):
        """One line that says what went wrong and where."""
        stack = reversed(self._xacro.filestack or [])
        where = next((os.path.abspath(each) for each in stack if each), self._file)
        text = as_written(" ".join(str(error).split())) or type(error).__name__
        while getattr(error, "exc", None):  # XacroException's reason
            error = error.exc
        if isinstance(error, PermissionError) and error.filename:
            folder = os.path.dirname(os.path.realpath(error.filename))
            text += f" (a xacro file reads what lies near it; RUEDO_PATH={folder} lets others in)"
        lost = ", ".join(sorted({name for _, name in self.missing}))
        return f"{where}: {text}" + (f"; not found: {lost}" if lost else "")


def main():
    if sys.argv[1:] == ["--parts"]:
        return print_parts()
    parser = argparse.ArgumentParser()
    parser.add_argument("file")
    parser.add_argument("--folder", action="append", default=[])
    parser.add_argument("--argument", action="append", default=[])
    arguments = parser.parse_args()
    output = os.fdopen(os.dup(1), "w", encoding="utf-8", errors="surrogateescape")
    os.dup2(2, 1)  # output of xacro is not part of the robot
    try:
        import xacro
    except ImportError:
        print(
            "the Python package xacro is missing: pip install xacro, beside Ruedo's Python client",
            file=sys.stderr,
        )
        return 2

    file = os.path.abspath(arguments.file)
    serve_packages(packages(roots_of(file, arguments.folder)), file)
    notes = Notes(xacro, file)
    try:
        document = xacro.process_file(
            file, mappings=dict(each.split(":=", 1) for each in arguments.argument)
        )
    except Exception as error:
        print(notes.fault(error), file=sys.stderr)
        return 1
    for name in dict.fromkeys(notes.read):
        print(f"read\t{name}", file=output)
    for where, name in dict.fromkeys(notes.missing):
        print(f"missing\t{where}\t{name}", file=output)
    # A missing package keeps its name, as in other files.
    robot = document.toxml().replace("file://" + MISSING, MISSING)
    print(f"\n{robot.replace(MISSING + '/', 'package://')}", file=output, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
