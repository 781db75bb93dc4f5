"""A document whose sections are written by one script each."""

import re


def section(path, title):
    """The text of "## TITLE", to the next one; "" where there is none."""
    found = re.search(
        rf"(?ms)^## {re.escape(title)}\n(.*?)(?=^## |\Z)", path.read_text(encoding="utf-8")
    )
    return found.group(1).strip("\n") if found else ""


def put(path, title, text):
    """Rewrites that section, in its place or at the end."""
    old = path.read_text(encoding="utf-8")
    new = f"## {title}\n\n{text.strip()}\n"
    pattern = rf"(?ms)^## {re.escape(title)}\n.*?(?=^## |\Z)"
    if re.search(pattern, old):
        text = re.sub(pattern, lambda _: new + "\n", old)
    else:
        text = old.rstrip("\n") + "\n\n" + new
    path.write_text(text.rstrip("\n") + "\n", encoding="utf-8")
