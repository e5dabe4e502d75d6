"""What the generators of the pages share: a committed page held against the computed one."""

from __future__ import annotations

import difflib
import re
from pathlib import Path

PAPERS = Path(__file__).resolve().parents[2] / "docs" / "papers"
IMAGES = PAPERS / "img"


def linked(text: str) -> list[str]:
    """The figures and tables that a page shows or links to, as paths relative to it."""
    return re.findall(r"\]\(([^):]+\.(?:svg|png|csv))\)", text)


def check(page: Path, text: str) -> int:
    """Compare the committed page with the computed one, line by line; 1 if they differ or a file is missing."""
    committed = page.read_text(encoding="utf-8") if page.exists() else ""
    difference = list(
        difflib.unified_diff(committed.splitlines(), text.splitlines(), "committed", "computed", lineterm="", n=0)
    )
    missing = [target for target in linked(text) if not (page.parent / target).exists()]
    print("\n".join([*difference, *(f"missing: {name}" for name in missing)]) or f"{page.name} is up to date")
    return 1 if difference or missing else 0
