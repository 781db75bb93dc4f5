"""Prints every text that a user may read, to be read in one sitting: PLACE, a tab, the text.

    scripts/texts.py [WORD...]        (with words: only the texts that hold one of them)

Texts are errors, warnings, help, docstrings, documentation of the C++ headers and of Java, and what
the page says. A literal counts that has three words or more; neighbouring literals are one text. {}
and %s stand where values go.
"""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("src", "include", "clients", "web/src", "scripts")
LITERAL = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
NEIGHBOURS = re.compile(r'"(?:[^"\\\n]|\\.)*"(?:\s*(?:\+\s*)?"(?:[^"\\\n]|\\.)*")*')
IN_TYPESCRIPT = re.compile(r'"(?:[^"\\\n]|\\.)*"|`(?:[^`\\]|\\.)*`')
COMMENT = re.compile(r'"(?:[^"\\\n]|\\.)*"|//[^\n]*|/\*.*?\*/', re.DOTALL)
DOCUMENTED = re.compile(r"/\*\*(.*?)\*/|((?:///[^\n]*\n?[ \t]*)+)", re.DOTALL)
Text = tuple[int, str]  # line, text


def is_text(text: str) -> bool:
    return text.count(" ") >= 2 and re.search("[a-z]{2}", text) is not None


def without_comments(text: str) -> str:
    """C++, Java or TypeScript, with blanks where comments were."""

    def kept(match: re.Match[str]) -> str:
        found = match.group(0)
        return found if found.startswith('"') else "".join(c if c == "\n" else " " for c in found)

    return COMMENT.sub(kept, text)


def of_c_family(text: str, pattern: re.Pattern[str] = NEIGHBOURS) -> Iterator[Text]:
    code = without_comments(text)
    for match in pattern.finditer(code):
        found = match.group(0)
        joined = "".join(LITERAL.findall(found)) if pattern is NEIGHBOURS else found[1:-1]
        yield code.count("\n", 0, match.start()) + 1, joined


def of_documented(text: str) -> Iterator[Text]:
    """Literals, and comments of Javadoc and Doxygen."""
    yield from of_c_family(text)
    for match in DOCUMENTED.finditer(text):
        lines = (match.group(1) or match.group(2)).split("\n")
        said = " ".join(re.sub(r"^\s*(?:\*|///<?)\s?", "", line) for line in lines)
        yield text.count("\n", 0, match.start()) + 1, said


def of_python(text: str) -> Iterator[Text]:
    """Literals and docstrings; of an f-string the parts between its values."""
    outside: list[ast.AST] = [ast.parse(text)]
    while outside:
        node = outside.pop(0)
        if not isinstance(node, ast.JoinedStr):
            outside += ast.iter_child_nodes(node)
        if isinstance(node, ast.JoinedStr):
            parts = [
                str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values
            ]
            yield node.lineno, "".join(parts)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.lineno, node.value


READERS = {
    ".cpp": of_c_family,
    ".h": of_documented,
    ".java": of_documented,
    ".ts": lambda text: of_c_family(text, IN_TYPESCRIPT),
    ".py": of_python,
}


def texts(root: Path = ROOT) -> Iterator[tuple[str, int, str]]:
    """(file, line, text in one line), in the order of the files."""
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            reader = READERS.get(path.suffix)
            if not reader or {"node_modules", "examples", "lcmtypes"} & set(path.parts):
                continue
            for line, text in reader(path.read_text(encoding="utf-8")):
                if is_text(text):
                    yield str(path.relative_to(root)), line, " ".join(text.split())


if __name__ == "__main__":
    words = sys.argv[1:]
    for file, line, text in texts():
        if not words or any(word in text for word in words):
            print(f"{file}:{line}\t{text}")
