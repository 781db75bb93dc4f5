"""Fits of a robot's errors to logs of the real one, and worlds from recorded drives.

    from ruedo.fit import read

    recording = read("drive.log.gz")
    print(recording.kind, recording.findings)

The commands `ruedo fit` and `ruedo import` (docs/fit.md) use it. Needs `pip install 'ruedo[fit]'`.
"""

from .errors import FitError
from .read import read
from .recording import Recording

__all__ = ["FitError", "Recording", "read"]
