"""Campaigns: many runs of one experiment, judged, kept and reported.

    from ruedo.campaign import Campaign

    campaign = Campaign("corridor.yaml")                # or a dict of the same members
    results = campaign.run(workers=2)                   # what was run before comes from the folder
    print(results.frame().groupby("controller").passed.mean())

A campaign is one YAML file (docs/campaigns.md); `ruedo campaign run FILE` does the same from a
shell. Needs `pip install 'ruedo[campaign]'`.
"""

from .campaign import Campaign
from .controller import DONE, View
from .errors import CampaignError, SpecError
from .plan import Case
from .store import Results

__all__ = ["DONE", "Campaign", "CampaignError", "Case", "Results", "SpecError", "View"]
