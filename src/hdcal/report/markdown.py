"""Markdown as HTML and as what a terminal prints.

A paragraph that is one image is a figure: its address is the name of a chart, its text
is for those who cannot see it, its title the caption. A terminal leaves figures out.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any

from markdown_it import MarkdownIt
from markdown_it.renderer import RendererHTML
from markdown_it.token import Token

# Rows of a table in a terminal or a notebook, and on a page until it is turned.
MOST_ROWS, PAGE_ROWS = 100, 25
# HTML of a figure, from the name of its chart, its text and its caption.
Figure = Callable[[str, str, str], str]
_PARSER = MarkdownIt("commonmark", {"html": False}).enable("table")


def parsed(text: str) -> list[Token]:
    """Return the tokens of a text in Markdown, in which HTML has no meaning."""
    return _PARSER.parse(text)


def html(tokens: Sequence[Token], figure: Figure | None = None) -> str:
    """Return tokens as HTML.

    Args:
        tokens: of Markdown.
        figure: HTML of a figure, from its name, its text and its caption; without it
            figures are left out and tables are cut, as in a notebook.
    """
    listed = paged(tokens) if figure else cut(without_figures(tokens))
    return _Renderer(figure).render(listed, _PARSER.options, {})


def folded(text: str, figure: Figure) -> str:
    """Return Markdown as HTML in which a heading of level 2 begins a folded section."""
    pieces: list[str] = []
    for level, heading, tokens in _sections(parsed(text)):
        title, content = html(heading), html(tokens, figure)
        if level == 2:
            content = f"<details><summary>{title}</summary>{content}</details>"
        elif level == 1:
            content = f"<h2>{title}</h2>{content}"
        pieces.append(content)
    return "\n".join(pieces)


def _sections(
    tokens: Sequence[Token],
) -> Iterator[tuple[int, Sequence[Token], Sequence[Token]]]:
    """Yield level, heading and content of each section of level 1 or 2."""
    starts = [i for i, token in enumerate(tokens) if token.type == "heading_open"]
    starts = [i for i in starts if tokens[i].tag in ("h1", "h2")]
    yield 0, (), tokens[: starts[0] if starts else None]
    for start, stop in pairwise([*starts, len(tokens)]):
        content = tokens[start + 3 : stop]
        yield int(tokens[start].tag[1]), [tokens[start + 1]], content


def is_number(cell: Token) -> bool:
    """Tell whether a cell belongs to a column that is aligned to the right."""
    return cell.attrs.get("style") == "text-align:right"


def figure_of(token: Token) -> Token | None:
    """Return the image of a paragraph's content that is nothing else."""
    children = token.children or []
    return children[0] if [c.type for c in children] == ["image"] else None


def without_figures(tokens: Sequence[Token]) -> list[Token]:
    """Return tokens without paragraphs that are figures."""
    at = [i for i, t in enumerate(tokens) if t.type == "inline" and figure_of(t)]
    left_out = {i + shift for i in at for shift in (-1, 0, 1)}
    return [token for i, token in enumerate(tokens) if i not in left_out]


def cut(tokens: Sequence[Token]) -> list[Token]:
    """Return tokens in which tables end after some rows, and say so."""
    kept: list[Token] = []
    row = 0
    for token in tokens:
        row = 0 if token.type == "tbody_open" else row + (token.type == "tr_open")
        inside = token.type.startswith(("tr_", "td_")) or token.type == "inline"
        if row <= MOST_ROWS or not inside:
            kept.append(token)
        if token.type == "table_close":
            if row > MOST_ROWS:
                kept += parsed(f"{row - MOST_ROWS} more rows are not shown.")
            row = 0
    return kept


def paged(tokens: Sequence[Token]) -> list[Token]:
    """Return tokens in which a script can turn the pages of long tables."""
    found: list[Token] = []
    table, row = Token("", "", 0), 0
    for token in tokens:
        if token.type == "table_open":
            table = token
        row = 0 if token.type == "tbody_open" else row + (token.type == "tr_open")
        if token.type == "tr_open" and row == PAGE_ROWS + 1:
            table.attrSet("data-page", str(PAGE_ROWS))
            rest = Token("tbody_open", "tbody", 1, {"hidden": "hidden"})
            found += [Token("tbody_close", "tbody", -1), rest]
        found.append(token)
    return found


class _Renderer(RendererHTML):
    """HTML of a page that allows no style inside an element."""

    def __init__(self, figure: Figure | None):
        super().__init__()
        self._figure = figure

    def table_open(self, tokens: Any, idx: int, options: Any, env: Any) -> str:
        frame = '<div class="wide" tabindex="0" role="group" aria-label="Table">'
        return frame + self.renderToken(tokens, idx, options, env)

    def table_close(self, tokens: Any, idx: int, options: Any, env: Any) -> str:
        return self.renderToken(tokens, idx, options, env) + "</div>"

    def th_open(self, tokens: Any, idx: int, options: Any, env: Any) -> str:
        kind = ' class="number"' if is_number(tokens[idx]) else ""
        return f"<{tokens[idx].tag}{kind}>"

    td_open = th_open

    def paragraph_open(self, tokens: Any, idx: int, options: Any, env: Any) -> str:
        figure = self._figure and figure_of(tokens[idx + 1])
        return "" if figure else self.renderToken(tokens, idx, options, env)

    def paragraph_close(self, tokens: Any, idx: int, options: Any, env: Any) -> str:
        figure = self._figure and figure_of(tokens[idx - 1])
        return "" if figure else self.renderToken(tokens, idx, options, env)

    def image(self, tokens: Any, idx: int, options: Any, env: Any) -> str:
        if self._figure is None:
            return ""
        shows = self.renderInlineAsText(tokens[idx].children, options, env)
        name, caption = (
            str(tokens[idx].attrs.get(key, "")) for key in ("src", "title")
        )
        return self._figure(name, shows, caption)
