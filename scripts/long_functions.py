"""long_functions.py FILE...: names functions of more than 60 lines, and fails if there is one."""

import sys
from pathlib import Path

import lizard

LONGEST = 60
SUFFIXES = {".cpp", ".h", ".java", ".py", ".ts"}


def main(files):
    fault = False
    for path in files:
        if Path(path).suffix not in SUFFIXES:
            continue
        for function in lizard.analyze_file(path).function_list:
            lines = function.end_line - function.start_line + 1
            if lines > LONGEST and function.name != "(anonymous)":  # a group of tests is one
                fault = True
                print(
                    f"{path}:{function.start_line}: {function.name} has {lines} lines;"
                    f" {LONGEST} is the most"
                )
    return 1 if fault else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
