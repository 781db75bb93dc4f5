"""failed_tests.py REPORT: the failed tests of a JUnit report by ctest, each with the end of its
output.
"""

import sys
from xml.etree import ElementTree

LINES = 60  # of each test's output


def main(report):
    for case in ElementTree.parse(report).getroot().iter("testcase"):
        if case.get("status") != "fail":
            continue
        lines = (case.findtext("system-out") or "").rstrip().splitlines()
        print(f"--- {case.get('name')} failed after {float(case.get('time', 0)):.1f} s:")
        print(*lines[-LINES:], sep="\n")
    print("---")


if __name__ == "__main__":
    main(sys.argv[1])
