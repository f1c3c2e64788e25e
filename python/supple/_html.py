"""Tables for notebooks."""

from __future__ import annotations

import html
from collections.abc import Sequence


def table(title: str, rows: Sequence[tuple[str, str]]) -> str:
    """A table of two columns under a title."""
    body = "".join(
        f"<tr><th style='text-align:left'>{html.escape(name)}</th><td style='text-align:left'>{html.escape(text)}</td></tr>"
        for name, text in rows
    )
    return f"<div><strong>{html.escape(title)}</strong><table><tbody>{body}</tbody></table></div>"
