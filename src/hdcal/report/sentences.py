"""Sentences of a result, rendered from the Markdown template of its question.

A template defines the blocks `title`, `subtitle`, `headline`, `next_step`, `body` and
`page`. The last one is for the HTML page only: each `##` heading begins a folded
section, each `#` heading a group of them. Variables are `result`, `units`, `part` (what
was measured: gear or part), `command` (the command line) and `on_page` (whether the
body is for the page).
"""

import re
import shlex
from collections.abc import Iterator, Mapping
from functools import cache, partial
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from jinja2.runtime import Context
from markupsafe import Markup

from hdcal.errors import printable
from hdcal.report.words import (
    capital,
    digits,
    hypothesis,
    label,
    load,
    number,
    percent,
    unit,
)

_PUNCTUATION = re.compile(r"([!-/:-@\[-`{-~])")


def rendered(
    template: str, block: str, values: Mapping[str, Any], *, plain: bool = False
) -> str:
    """Return a block of a template, given by its path in the package; empty if none.

    A plain text has no escapes of Markdown. Texts of variables may come from files.
    """
    page = _environment(plain).get_template(template)
    context = page.new_context(dict(values))
    # The template runs without its blocks, to define its variables and macros.
    blocks, context.blocks = context.blocks, {name: [_nothing] for name in page.blocks}
    "".join(page.root_render_func(context))
    context.blocks = blocks
    return "".join(blocks[block][0](context)) if block in blocks else ""


def _nothing(_: Context) -> Iterator[str]:
    return iter(())


@cache
def _environment(plain: bool) -> Environment:
    # With `autoescape` the text of a template is Markup; other texts are escaped.
    environment = Environment(
        loader=PackageLoader("hdcal", ""),
        autoescape=True,
        finalize=partial(_shown, plain=plain),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    filters = (
        capital,
        code,
        digits,
        hypothesis,
        label,
        load,
        median,
        number,
        percent,
        span,
        unit,
    )
    environment.filters |= {function.__name__: function for function in filters}
    environment.filters["argument"] = shlex.quote
    return environment


def _shown(value: Any, *, plain: bool) -> Any:
    """Return a text whose characters Markdown, unless plain, shows as they are."""
    if not isinstance(value, str) or isinstance(value, Markup):
        return value
    text = printable(value)
    return Markup(text if plain else _PUNCTUATION.sub(r"\\\1", text))


def code(text: str) -> Markup:
    """Return a text as code in Markdown; not for the cells of a table."""
    longest = max(map(len, re.findall("`+", text)), default=0)
    fence, space = "`" * (longest + 1), " " if longest else ""
    return Markup(f"{fence}{space}{printable(text)}{space}{fence}")


def median(interval: Any) -> str:
    """Return the median with the digits that its interval supports."""
    return number(interval.median, interval.hi - interval.lo)


def span(interval: Any) -> str:
    """Return both ends of an interval."""
    width = interval.hi - interval.lo
    return f"{number(interval.lo, width)} … {number(interval.hi, width)}"
