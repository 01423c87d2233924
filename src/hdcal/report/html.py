"""A document as one HTML page that needs nothing else and opens offline."""

import base64
from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from importlib.resources import files

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

from hdcal.report.document import Document
from hdcal.report.plain import printable


def html_page(
    document: Document, images: Mapping[str, bytes], template: str = "page.html.j2"
) -> str:
    """Return a document as the text of an HTML file.

    Args:
        document: what to show; its texts may come from anywhere.
        images: SVG files drawn by hdcal, by the names of the document's pictures.
        template: of the page.

    Raises:
        KeyError: a picture has no drawing.
    """
    pictures = {name: _address(image) for name, image in images.items()}
    style = files("hdcal.report").joinpath("templates/style.css").read_text("utf-8")
    return _template(template).render(
        document=document, images=pictures, style=style, policy=_policy(style)
    )


def _policy(style: str) -> str:
    """Return what the page may do: show its own style and pictures, and no more."""
    digest = base64.b64encode(sha256(style.encode()).digest()).decode("ascii")
    own = f"style-src 'sha256-{digest}'; img-src data:"
    return f"default-src 'none'; {own}; base-uri 'none'; form-action 'none'"


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
