"""long_functions.py FILE...: names the functions of more than 60 lines, and fails but for those of
long_functions.txt, which must all be as long still.
"""

import sys
from pathlib import Path

import lizard

LONGEST = 60
SUFFIXES = {".cpp", ".h", ".java", ".py", ".ts"}


def long_functions(files):
    """{"FILE FUNCTION": (line, lines)}."""
    found = {}
    for path in files:
        for function in lizard.analyze_file(path).function_list:
            lines = function.end_line - function.start_line + 1
            if lines > LONGEST and function.name != "(anonymous)":  # a group of tests is one
                found[f"{path} {function.name}"] = function.start_line, lines
    return found


def main(files):
    listed = Path(__file__).with_name("long_functions.txt").read_text(encoding="utf-8").splitlines()
    allowed = {line for line in listed if line and not line.startswith("#")}
    found = long_functions(file for file in files if Path(file).suffix in SUFFIXES)
    for name in sorted(found.keys() - allowed):
        path, function = name.split(" ")
        line, lines = found[name]
        print(f"{path}:{line}: {function} has {lines} lines; {LONGEST} is the most")
    for name in sorted(allowed - found.keys()):
        print(f"{name} is short now, or gone: take it out of scripts/long_functions.txt")
    return 1 if found.keys() ^ allowed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
