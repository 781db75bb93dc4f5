"""The code blocks of docs/*.md that are marked <!-- test: NAME -->."""

import re

from conftest import SOURCE

_BLOCK = re.compile(r"<!-- test: (\w+) -->\n```\w*\n(.*?)```", re.DOTALL)


def blocks(page: str) -> dict[str, str]:
    return dict(_BLOCK.findall((SOURCE / "docs" / page).read_text()))
