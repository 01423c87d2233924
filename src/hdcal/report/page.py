"""One HTML page that needs nothing else, from a template and harmless texts."""

import base64

from jinja2 import Environment, PackageLoader, StrictUndefined

from hdcal.report.plain import harmless


def render_page(template: str, context: dict, images: dict[str, bytes]) -> str:
    """Return a page as text.

    Args:
        template: name of the file in templates.
        context: texts and numbers, from anywhere.
        images: SVG files, drawn by hdcal.
    """
    # Escaping is on for every text; only the images' bytes are ours entirely.
    environment = Environment(
        loader=PackageLoader("hdcal.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    pictures = {name: _address(image) for name, image in images.items()}
    page = environment.get_template(template)
    return page.render(**harmless(context), images=pictures)


def _address(image: bytes) -> str:
    # As an image the drawing can run no script and share no names with the page.
    return "data:image/svg+xml;base64," + base64.b64encode(image).decode("ascii")
