from pathlib import Path

Path(__file__).parents[1].joinpath("labs.campaign/results.sqlite").write_bytes(b"")
