"""The errors of campaigns, each with the exit code of the command line."""

from __future__ import annotations

from ..errors import RuedoError


class CampaignError(RuedoError):
    """The campaign cannot be run here: the machine, the disk, a cluster."""

    exit_code = 4


class NothingCompared(CampaignError):
    """Two campaigns have no case in common: that says nothing of either."""

    exit_code = 1


class UsageError(CampaignError, ValueError):
    """The command line is wrong, whatever the files hold."""

    exit_code = 2


class ResultsError(CampaignError, ValueError):
    """A folder of results is damaged, or holds something else."""

    exit_code = 3


class SpecError(CampaignError, ValueError):
    """The campaign's file is wrong: file, line, member, value and what is allowed."""

    exit_code = 3


def missing(package: str, extra: str) -> CampaignError:
    """A package that an extra of pip's brings is not there."""
    return CampaignError(f"this needs {package}: pip install 'ruedo[{extra}]'")
