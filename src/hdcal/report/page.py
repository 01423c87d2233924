"""A result as one HTML page that needs no other file, and as a notebook's cell."""

import base64
from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from importlib.resources import files
from typing import TYPE_CHECKING

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from hdcal.report.charts.chart_browser import chart_json
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.markdown import folded, html, parsed

if TYPE_CHECKING:
    from hdcal.report.result import Result

_IMAGE = Markup('<img src="data:image/svg+xml;base64,{}" alt="{}">')
_FIGURE = Markup("<figure{}>{}<figcaption>{}</figcaption></figure>")
_INTERACTIVE = Markup(
    '<script type="application/json">{}</script><p class="hint soft">Drag to zoom, or '
    "turn the wheel; drag with shift to move; double-click to see all.</p>"
)


def html_page(
    result: "Result", command: str = "", images: Mapping[str, bytes] | None = None
) -> str:
    """Return a result as the text of an HTML file.

    Args:
        result: what to show.
        command: the command line that made it.
        images: SVG of each chart; by default they are drawn.
    """
    charts = result.charts()
    drawn = _drawn(charts) if images is None else images

    def figure(name: str, shows: str, caption: str) -> str:
        # As an image the drawing runs no script and shares no names with the page.
        image = _IMAGE.format(base64.b64encode(drawn[name]).decode("ascii"), shows)
        bars = all(panel.horizontal for panel in charts[name].panels)
        if charts[name].failed or bars:
            # The image carries the mark, and names beside bars: an interactive chart
            # would not.
            return _FIGURE.format("", image, caption)
        image += _INTERACTIVE.format(Markup(chart_json(charts[name])))
        return _FIGURE.format(Markup(" data-touch"), image, caption)

    body = html(parsed(result.block("body", command, on_page=True)), figure)
    more = folded(result.block("page", command), figure)
    style, script = _part("style.css"), ""
    if "data-touch" in body + more:
        style += _part("uplot.css")
        script += _part("uplot.js") + _part("touch.js")
    if "data-page" in body + more:
        script += _part("turn.js")
    names = ("title", "subtitle", "headline", "next_step")
    page = _environment().get_template("result.html.j2")
    return page.render(
        {name: _inline(result, name) for name in names},
        result=result,
        name=result.line("title"),
        body=Markup(body),
        more=Markup(more),
        style=Markup(style),
        script=Markup(script),
        policy=Markup(_policy(style, script)),
    )


def sheet_page(result: "Result", block: str, signed: Mapping[str, str]) -> str:
    """Return a block of a result as the text of an HTML page to print and sign.

    Args:
        result: of the template.
        block: name of the block.
        signed: what stands above the line of signature, by its name.
    """
    style = _part("style.css")
    page = _environment().get_template("sheet.html.j2")
    return page.render(
        name=result.line("title"),
        body=Markup(html(parsed(result.block(block)))),
        signed={**signed, "signature": ""},
        style=Markup(style),
        policy=Markup(_policy(style, "")),
    )


def notebook_html(result: "Result") -> str:
    """Return what a notebook's cell shows of a result."""
    shown = _inline(result, "headline")
    if result.reasons:
        failed = Markup("FAILED — do not use this result. {}")
        shown = failed.format(" ".join(result.reasons))
    first = Markup('<div class="hdcal"><p>{}: {}</p><p><b>{}</b></p>').format(
        _inline(result, "title"), _inline(result, "subtitle"), shown
    )
    return first + Markup(html(parsed(result.block("body")))) + Markup("</div>")


def _drawn(charts: Mapping[str, Chart]) -> dict[str, bytes]:
    from hdcal.report.charts.chart_drawing import images

    return {
        name: images(chart, kinds=("svg",))["svg"] for name, chart in charts.items()
    }


def _inline(result: "Result", block: str) -> Markup:
    """Return a block that is one paragraph as HTML, without the frame of it."""
    tokens = parsed(result.block(block).strip())
    return Markup(html([token for token in tokens if token.type == "inline"]))


def _part(name: str) -> str:
    return files("hdcal.report").joinpath(f"templates/{name}").read_text("utf-8")


def _policy(style: str, script: str) -> str:
    """Return what the page may load: its own style, script and pictures."""
    allowed = f"style-src {_hash(style)}; img-src data:"
    if script:
        allowed += f"; script-src {_hash(script)}"
    return f"default-src 'none'; {allowed}; base-uri 'none'; form-action 'none'"


def _hash(text: str) -> str:
    digest = base64.b64encode(sha256(text.encode()).digest()).decode("ascii")
    return f"'sha256-{digest}'"


@cache
def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("hdcal.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
