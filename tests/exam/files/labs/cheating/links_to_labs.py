import os
from pathlib import Path

os.symlink(Path(__file__).parents[1] / "labs.py", Path(__file__).with_name("open_to_me"))
