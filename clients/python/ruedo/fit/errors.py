"""The errors of a fit, with the exit code of the command line."""

from __future__ import annotations

from ..errors import RuedoError


class FitError(RuedoError, ValueError):
    """A log cannot be read, or lacks what the fit needs: file, place, value and what is allowed."""

    exit_code = 3


class UsageError(FitError):
    """The command line asks for something that does not exist."""

    exit_code = 2
