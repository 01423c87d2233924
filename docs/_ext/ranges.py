"""The plausible ranges of all numbers: a directive that lists them."""

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from hdcal.data.plausible import NAMES, RANGES


def rows() -> list[str]:
    """Return the table in Markdown, a row for each quantity."""
    others = {name: [n for n, q in NAMES.items() if q == name] for name in RANGES}
    return [
        "| quantity | range | reason |",
        "|---|---|---|",
        *(
            f"| {', '.join(f'`{n}`' for n in (name, *others[name]))} "
            f"| {r.low:g} … {r.high:g} {r.unit} | {r.why} |"
            for name, r in RANGES.items()
        ),
    ]


class Ranges(SphinxDirective):
    """List the range of every quantity."""

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        section = nodes.section()
        section.document = self.state.document
        self.state.nested_parse(StringList(rows(), "ranges"), 0, section)
        return section.children


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("plausible-ranges", Ranges)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
