from pathlib import Path

exec(Path(__file__).with_name("solution.py").read_text())
