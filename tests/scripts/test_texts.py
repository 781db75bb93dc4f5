"""Texts for users keep to plain words: `scripts/texts.py` collects them. So do names of tests.

The phrases below, which readers misunderstood, do not come back.
"""

import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

import texts

RIDDLES = {
    r"(?<!there )(?<!There )\b(?:is|are) no (?!longer|more|less|way|need|doubt)": "is not a ...",
    r"this is said once": "shown once",
    r"\bheld up\b": "did not run",
    r"\bgoes? not\b": "cannot be used with",
    r"\bthat is no\b": "does not decode as, is not a",
    r"\bcan be taken over\b": "restore",
    r"\bwants (?:a|an|the|finite)\b": "needs",
    r"\bis none of\b": "is not one of",
    r"\btells more\b": "explains",
    r"\bis none\b": "is not a ..., is unknown",
    r"\b(?:is|are) wanted\b": "expected ...",
    r"\basked for\b": "required, requested, on first use",
    r"\b(?:is|be) told\b": "is commanded, reports",
    r"\bis that in\b": "is relative to",
    r"\bgoes on\b": "continues",
    r"\bnobody stands\b": "impossible steps",
    r"\bwhat acts\b": "applies, is used",
}

TEST = r"^TEST(?:_F|_P)?\(\s*\w+,\s*(\w+)|^ *(?:async )?def (test_\w+)\("
RIDDLE_OF_A_NAME = re.compile(
    "^What|(?:^|[a-z])(?:Who|Told|HeldUp|(?:Is|Are)(?:Named|Said))(?![a-z])|Anew$"
    "|^test_what_|_(?:who|told|held_up|(?:is|are)_(?:named|said))(?:_|$)|_anew$"
)


@pytest.fixture(scope="module")
def every_text():
    return list(texts.texts())


@pytest.mark.parametrize("riddle", RIDDLES)
def test_no_text_is_a_riddle(every_text, riddle):
    found = [
        f"{file}:{line}: {text[:200]}" for file, line, text in every_text if re.search(riddle, text)
    ]
    assert not found, f"say {RIDDLES[riddle]!r}:\n" + "\n".join(found)


def test_no_test_has_a_riddle_for_a_name():
    files = [*(ROOT / "tests").rglob("*.cpp"), *(ROOT / "tests").rglob("*.py")]
    names = [
        (file.name, name)
        for file in files
        for of_cpp, of_python in re.findall(TEST, file.read_text(encoding="utf-8"), re.MULTILINE)
        if (name := of_cpp or of_python)
    ]
    assert len(names) > 2000
    assert not [name for name in names if RIDDLE_OF_A_NAME.search(name[1])]


@pytest.mark.parametrize(
    "name, source, expected",
    [
        ("a.cpp", 'fail("the wheel is " // why\n     "not there");', "the wheel is not there"),
        ("a.cpp", '// "a comment is not one"\nint x;', None),
        ("a.cpp", 'f("http://one is a text", 1);', "http://one is a text"),
        ("a.java", 'say("no robot of " + "that name");', "no robot of that name"),
        ("a.java", "/** Turns the robot\n * round. */ void turn();", "Turns the robot round."),
        ("a.h", "/// Turns the robot\n  /// round.\nvoid turn();", "Turns the robot round."),
        ("a.h", "double angle;  ///< of the robot's head", "of the robot's head"),
        ("a.py", 'f"no robot {name} is there"', "no robot {} is there"),
        ("a.py", '"""Turns the robot round."""', "Turns the robot round."),
        ("a.ts", "say(`no robot ${name} here`);", "no robot ${name} here"),
    ],
)
def test_texts_are_found(tmp_path, name, source, expected):
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / name).write_text(source)
    assert [text for _, _, text in texts.texts(tmp_path)] == ([expected] if expected else [])
