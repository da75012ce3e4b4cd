"""Formulas of the site as MathML, made when it is built: browsers show them without a script and without network."""

from __future__ import annotations

import html
import re
from typing import Any

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


def on_page_content(content: str, **_: Any) -> str:
    """MkDocs' hook: the LaTeX that pymdownx.arithmatex marked becomes MathML; LaTeX that is none ends the build."""
    return FORMULA.sub(_mathml, content)


def _mathml(found: re.Match[str]) -> str:
    from latex2mathml.converter import convert  # the site's extra alone brings it

    return convert(html.unescape(found[2]).strip(), display="block" if found[1] == "div" else "inline")
