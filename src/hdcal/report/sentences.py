"""Sentences of a result, rendered from the Markdown template of its question.

A template defines the blocks `title`, `subtitle`, `headline`, `next_step`, `body` and
`page`. A terminal, a notebook and the page show all but the last one, which is shown on
the page only: there each `##` heading begins a folded section, and each `#` heading a
group of them. Its variables are `result`, `part` (the word for what was measured),
`command` (the command line) and `on_page` (whether the body is for the page).
"""

import re
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from jinja2.runtime import Context
from markupsafe import Markup

from hdcal.report.plain import printable
from hdcal.report.words import capital, hypothesis, label, load, number, percent, unit

_PUNCTUATION = re.compile(r"([!-/:-@\[-`{-~])")


def rendered(
    template: str, block: str, values: Mapping[str, Any], *, plain: bool = False
) -> str:
    """Return one block of a template; nothing where the template has no such block.

    Args:
        template: address of the template inside the package.
        block: name of the block.
        values: of its variables; texts among them may come from files.
        plain: leave out the escapes of Markdown, for texts that are not rendered.
    """
    page = _environment(plain).get_template(template)
    context = page.new_context(dict(values))
    # Variables and macros at the top exist once the template has run, which here
    # renders no block: another one may need a result that this one gives.
    blocks, context.blocks = context.blocks, {name: [_nothing] for name in page.blocks}
    "".join(page.root_render_func(context))
    context.blocks = blocks
    return "".join(blocks[block][0](context)) if block in blocks else ""


def _nothing(_: Context) -> Iterator[str]:
    return iter(())


@cache
def _environment(plain: bool) -> Environment:
    # `autoescape` makes what a template writes Markup; other texts are escaped.
    environment = Environment(
        loader=PackageLoader("hdcal", ""),
        autoescape=True,
        finalize=_printable if plain else _escaped,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "capital": capital,
        "code": code,
        "hypothesis": hypothesis,
        "label": label,
        "median": median,
        "load": load,
        "number": number,
        "percent": percent,
        "span": span,
        "unit": unit,
    }
    return environment


def _printable(value: Any) -> Any:
    if not isinstance(value, str) or isinstance(value, Markup):
        return value
    return Markup(printable(value))


def _escaped(value: Any) -> Any:
    """Return a text so that Markdown shows each of its characters."""
    if not isinstance(value, str) or isinstance(value, Markup):
        return value
    return Markup(_PUNCTUATION.sub(r"\\\1", printable(value)))


def code(text: str) -> Markup:
    """Return a text as code in Markdown; not for the cells of a table."""
    longest = max(map(len, re.findall("`+", text)), default=0)
    fence, space = "`" * (longest + 1), " " if longest else ""
    return Markup(f"{fence}{space}{printable(text)}{space}{fence}")


def median(interval: Any) -> str:
    """Return the median with the digits that the interval leaves meaningful."""
    return number(interval.median, interval.hi - interval.lo)


def span(interval: Any) -> str:
    """Return both ends of an interval."""
    width = interval.hi - interval.lo
    return f"{number(interval.lo, width)} … {number(interval.hi, width)}"
