"""A result as an HTML page that needs no other file, and in a notebook."""

import base64
from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from importlib.resources import files
from typing import TYPE_CHECKING

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from hdcal.report.charts.chart_browser import chart_json
from hdcal.report.markdown import folded, html, parsed

if TYPE_CHECKING:
    from hdcal.report.result import Result

_IMAGE = Markup('<img src="data:image/svg+xml;base64,{}" alt="{}">')
_FIGURE = Markup("<figure{}>{}<figcaption>{}</figcaption></figure>")
_INTERACTIVE = Markup(
    '<script type="application/json">{}</script><p class="hint soft">Drag to zoom, '
    "double-click to see all.</p>"
)


def html_page(
    result: "Result", command: str = "", images: Mapping[str, bytes] | None = None
) -> str:
    """Return a result as the text of an HTML file, with the command that made it.

    The images are SVG by chart; by default they are drawn.
    """
    charts = result.charts()
    if images is None:
        from hdcal.report.charts import chart_drawing

        images = {
            name: chart_drawing.images(chart, kinds=("svg",))["svg"]
            for name, chart in charts.items()
        }

    def figure(name: str, shows: str, caption: str) -> str:
        # SVG in an image runs no script and shares no names with the page.
        image = _IMAGE.format(base64.b64encode(images[name]).decode("ascii"), shows)
        if not charts[name].interactive:
            return _FIGURE.format("", image, caption)
        image += _INTERACTIVE.format(Markup(chart_json(charts[name])))
        return _FIGURE.format(Markup(" data-touch"), image, caption)

    body = html(parsed(result.block("body", command, on_page=True)), figure)
    more = folded(result.block("page", command), figure)
    style, script = _part("style.css"), ""
    if "data-touch" in body + more:
        style += _part("uplot.css")
        script += _part("uplot.js") + _part("touch.js")
    names = ("title", "subtitle", "headline", "next_step")
    return (
        _environment()
        .get_template("result.html.j2")
        .render(
            {name: _inline(result, name) for name in names},
            result=result,
            name=result.line("title"),
            body=Markup(body),
            more=Markup(more),
            style=Markup(style),
            script=Markup(script),
            policy=Markup(_policy(style, script)),
        )
    )


def sheet_page(result: "Result", block: str, signed: Mapping[str, str]) -> str:
    """Return a block of a result as the text of an HTML page to print and sign.

    `signed` are the texts above the lines of signature, by the names below them.
    """
    style = _part("style.css")
    return (
        _environment()
        .get_template("sheet.html.j2")
        .render(
            name=result.line("title"),
            body=Markup(html(parsed(result.block(block)))),
            signed={**signed, "signature": ""},
            style=Markup(style),
            policy=Markup(_policy(style, "")),
        )
    )


def notebook_html(result: "Result") -> str:
    """Return a result as a notebook shows it."""
    shown = _inline(result, "headline")
    if result.reasons:
        failed = Markup("FAILED — do not use this result. {}")
        shown = failed.format(" ".join(result.reasons))
    first = Markup('<div class="hdcal"><p>{}: {}</p><p><b>{}</b></p>').format(
        _inline(result, "title"), _inline(result, "subtitle"), shown
    )
    return first + Markup(html(parsed(result.block("body")))) + Markup("</div>")


def _inline(result: "Result", block: str) -> Markup:
    """Return a block of one paragraph as HTML without the paragraph's tags."""
    tokens = parsed(result.block(block).strip())
    return Markup(html([token for token in tokens if token.type == "inline"]))


def _part(name: str) -> str:
    return files("hdcal.report").joinpath(f"templates/{name}").read_text("utf-8")


def _policy(style: str, script: str) -> str:
    """Return a content security policy: only this style, this script and images."""

    def source(text: str) -> str:
        digest = base64.b64encode(sha256(text.encode()).digest()).decode("ascii")
        return f"'sha256-{digest}'"

    allowed = f"style-src {source(style)}; img-src data:"
    allowed += f"; script-src {source(script)}" if script else ""
    return f"default-src 'none'; {allowed}; base-uri 'none'; form-action 'none'"


@cache
def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("hdcal.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
