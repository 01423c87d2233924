"""A document as one HTML page that needs nothing else and opens offline."""

import base64
from collections.abc import Mapping, Sequence
from functools import cache
from hashlib import sha256
from importlib.resources import files
from typing import NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

from hdcal.report.chart import Chart, charts_json
from hdcal.report.chart_browser import chart_json
from hdcal.report.chart_spec import Chart as ChartSpec
from hdcal.report.document import Document, Table
from hdcal.report.plain import printable


class Drawing(NamedTuple):
    """A picture as the page holds it.

    Attributes:
        address: of the image.
        touch: its charts as JSON, for browsers that run scripts; empty without any.
    """

    address: str
    touch: str


def html_page(
    document: Document,
    images: Mapping[str, bytes],
    template: str = "page.html.j2",
    charts: Mapping[str, Sequence[Chart] | ChartSpec] | None = None,
) -> str:
    """Return a document as the text of an HTML file.

    Args:
        document: what to show; its texts may come from anywhere.
        images: SVG files drawn by hdcal, by the names of the document's pictures.
        template: of the page.
        charts: the same pictures to be touched, of those that can be.

    Raises:
        KeyError: a picture has no drawing.
    """
    touched = {
        name: chart_json(each) if isinstance(each, ChartSpec) else charts_json(each)
        for name, each in (charts or {}).items()
    }
    drawings = {
        name: Drawing(_address(image), touched.get(name, ""))
        for name, image in images.items()
    }
    style, script = _part("style.css"), ""
    if touched:
        style += _part("uplot.css")
        script = _part("uplot.js") + _part("touch.js")
    blocks = (block for section in document.sections for block in section.blocks)
    if any(isinstance(block, Table) and block.page for block in blocks):
        script += _part("turn.js")
    return _template(template).render(
        document=document,
        images=drawings,
        style=style,
        script=script,
        policy=_policy(style, script),
    )


def _part(name: str) -> str:
    return files("hdcal.report").joinpath(f"templates/{name}").read_text("utf-8")


def _policy(style: str, script: str) -> str:
    """Return what the page may do: show its own style, pictures and charts."""
    own = f"style-src {_hash(style)}; img-src data:"
    if script:
        own += f"; script-src {_hash(script)}"
    return f"default-src 'none'; {own}; base-uri 'none'; form-action 'none'"


def _hash(text: str) -> str:
    digest = base64.b64encode(sha256(text.encode()).digest()).decode("ascii")
    return f"'sha256-{digest}'"


def notebook_html(document: Document) -> str:
    """Return what matters most of a document, as a fragment for a notebook's cell."""
    return _template("notebook.html.j2").render(document=document)


@cache
def _template(name: str) -> Template:
    # Escaping is on for every text; only the images' bytes are ours entirely.
    environment = Environment(
        loader=PackageLoader("hdcal.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: printable(value) if type(value) is str else value,
    )
    return environment.get_template(name)


def _address(image: bytes) -> str:
    # As an image the drawing can run no script and share no names with the page.
    return "data:image/svg+xml;base64," + base64.b64encode(image).decode("ascii")
