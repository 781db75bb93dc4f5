"""Hunts: the case that breaks a controller, found, shrunk, and kept as a regression test.

    from ruedo.hunt import Hunt

    found = Hunt("corridor.yaml").run(cases=200, seed=1)
    if found:
        print(found.reason, found.choices)
        found.keep("regressions/corridor")

A hunt is a campaign's file with ranges (docs/campaigns.md). Needs `pip install 'ruedo[hunt]'`.
"""

from .hunt import Found, Hunt

__all__ = ["Found", "Hunt"]
