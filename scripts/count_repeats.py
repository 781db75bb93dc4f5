"""count_repeats.py REPORT REPEATS: adds to a JUnit report by ctest, as properties, which tests
began anew and how often (tests/witness.py).
"""

import sys
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree


def main(report, repeats):
    counts = Counter(Path(repeats).read_text(encoding="utf-8").splitlines())
    tree = ElementTree.parse(report)
    properties = ElementTree.Element("properties")
    tree.getroot().insert(0, properties)
    counted = {"begun anew": counts.total()}
    counted |= {f"begun anew: {test}": count for test, count in sorted(counts.items())}
    for name, count in counted.items():
        ElementTree.SubElement(properties, "property", name=name, value=str(count))
    tree.write(report, encoding="UTF-8", xml_declaration=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
