"""`ruedo campaign`, `ruedo hunt` and `ruedo why`: python3 -m ruedo.campaign COMMAND ..."""

from __future__ import annotations

import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
