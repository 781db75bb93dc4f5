"""Mutation testing of what judges: each comparison of some sources negated, each branch that fails,
returns or goes on left out, one at a time. A mutant that no test kills is printed.

    mutants.py BUILD TARGET SOURCE -- COMMAND...

SOURCE is mutated as a whole, with a switch for each mutant, compiled once, and linked into a copy
of TARGET beside it, which is {} in COMMAND. Needs tree-sitter and tree-sitter-cpp.
"""

import json
import os
import re
import shlex
import subprocess
import sys
import time
from pathlib import Path

import tree_sitter_cpp
from tree_sitter import Language, Parser

COMPARISONS = {"==", "!=", "<", ">", "<=", ">="}
UNMUTATED = {
    *("template_argument_list", "static_assert_declaration", "preproc_include", "preproc_if"),
    *("operator_name", "concept_definition"),
}
CONSTANT = re.compile(rb"\b(constexpr|consteval)\b")
LEAVES = re.compile(rb"^\{?\s*(return\b|throw\b|continue\b|break\b|fail\()")
SWITCH = b"""#include <cstdlib>
namespace {
[[maybe_unused]] bool mutant(int number) {
  static const int chosen = std::atoi(std::getenv("RUEDO_MUTANT") ? std::getenv("RUEDO_MUTANT") : "0");
  return number == chosen;
}
}  // namespace
"""
MOST_TIMES = 10  # as long as without a mutant: then it does not end


def mutated(source):
    """The text with a switch for each mutant, and [(line, what)] of these."""
    text = source.read_bytes()
    mutants, edits = [], []

    def add(node, what, before, after):
        mutants.append((node.start_point[0] + 1, f"{what}: {one_line(text, node)}"))
        number = str(len(mutants)).encode()
        edits.append((node.start_byte, 1, before.replace(b"N", number)))
        edits.append((node.end_byte, 0, after))

    def walk(node):
        if node.type in UNMUTATED:
            return
        if node.type in ("declaration", "field_declaration", "function_definition"):
            head = text[node.start_byte : node.start_byte + 40]
            if CONSTANT.search(head):
                return
        if node.type == "binary_expression":
            operator = node.child_by_field_name("operator")
            if operator.type in COMPARISONS:
                add(node, "negated", b"(mutant(N) != bool(", b"))")
        if node.type == "if_statement":
            then = node.child_by_field_name("consequence")
            condition = node.child_by_field_name("condition").child_by_field_name("value")
            plain = condition is not None and condition.type not in (
                "declaration",
                "init_statement",
            )
            head = node.child_by_field_name("condition")
            if (
                plain
                and head.named_child_count == 1
                and LEAVES.match(text[then.start_byte : then.end_byte])
            ):
                add(condition, "left out: if", b"!mutant(N) && (", b")")
        for child in node.children:
            walk(child)

    walk(Parser(Language(tree_sitter_cpp.language())).parse(text).root_node)
    # At one place, what ends comes before what begins; the outer begins first and ends last.
    order = sorted(enumerate(edits), key=lambda one: (one[1][0], one[1][1], one[0]))
    parts, at = [SWITCH, b'#line 1 "%s"\n' % str(source).encode()], 0
    for _, (place, _, new) in order:
        parts += [text[at:place], new]
        at = place
    return b"".join([*parts, text[at:]]), mutants


def one_line(text, node):
    return " ".join(text[node.start_byte : node.end_byte].decode().split())[:90]


def build(folder, target, source, text):
    """A copy of the target with the mutated source; its path."""
    [entry] = [
        one
        for one in json.loads((folder / "compile_commands.json").read_text())
        if one["file"] == str(source)
    ]
    made, mutant = folder / f"{target}-mutants.o", folder / f"{target}-mutants.cpp"
    mutant.write_bytes(text)
    words = shlex.split(entry["command"])
    place = words.index("-o")
    words[place + 1] = str(made)
    words = [str(mutant) if one == str(source) else one for one in words]
    subprocess.run([*words, f"-I{source.parent}"], cwd=entry["directory"], check=True)
    commands = subprocess.run(
        ["ninja", "-t", "commands", target], cwd=folder, check=True, capture_output=True, text=True
    ).stdout.splitlines()
    link = next(one for one in reversed(commands) if f"-o {target} " in f"{one} ")
    link = link.split("&&")[1] if "&&" in link else link
    words = shlex.split(link)
    place = words.index("-o")
    program = folder / f"{target}-mutants"
    own = [one for one in words if one.endswith(f"/{source.name}.o")]
    words = [one for one in words if one not in own]
    place = words.index("-o")
    words[place + 1] = str(program)
    words.insert(place, str(made))  # before the archive with the original
    subprocess.run(words, cwd=folder, check=True)
    return program


def main():
    split = sys.argv.index("--")
    folder, target, source = Path(sys.argv[1]).resolve(), sys.argv[2], Path(sys.argv[3]).resolve()
    text, mutants = mutated(source)
    program = build(folder, target, source, text)
    command = [word.replace("{}", str(program)) for word in sys.argv[split + 1 :]]

    patience = None

    def passes(number):
        environment = {**os.environ, "RUEDO_MUTANT": str(number)}
        try:
            return not subprocess.run(
                command, env=environment, capture_output=True, timeout=patience
            ).returncode
        except subprocess.TimeoutExpired:
            return False

    begin = time.monotonic()
    if not passes(0):
        sys.exit(f"{source}: the tests fail without a mutant")
    patience = MOST_TIMES * (time.monotonic() - begin) + 1.0
    left = [(number + 1, *one) for number, one in enumerate(mutants) if passes(number + 1)]
    for number, line, what in left:
        print(f"{source.name}:{line}: mutant {number} lives: {what}")
    killed = len(mutants) - len(left)
    print(
        f"{source.name}: {killed} of {len(mutants)} mutants killed ({killed / max(len(mutants), 1):.0%})"
    )
    sys.exit(killed < 0.9 * len(mutants))


main()
