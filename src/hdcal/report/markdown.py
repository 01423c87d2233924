"""Markdown as HTML and for a terminal.

A paragraph that is one image is a figure: the address is the name of a chart, the text
its description, the title its caption. A terminal leaves figures out.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

from markdown_it import MarkdownIt
from markdown_it.renderer import RendererHTML
from markdown_it.token import Token

# Rows of a table in a terminal or a notebook.
_MOST_ROWS = 100
# HTML of a figure, from the name of its chart, its description and its caption.
Figure = Callable[[str, str, str], str]
_PARSER = MarkdownIt("commonmark", {"html": False}).enable("table")


def parsed(text: str) -> list[Token]:
    """Return the tokens of Markdown, in which HTML has no meaning."""
    return _PARSER.parse(text)


def html(tokens: Sequence[Token], figure: Figure | None = None) -> str:
    """Return tokens as HTML; without `figure` as `shortened`."""
    tokens = tokens if figure else shortened(tokens)
    return _Renderer(figure).render(tokens, _PARSER.options, {})


def folded(text: str, figure: Figure) -> str:
    """Return Markdown as HTML in which each heading of level 2 folds its section."""
    tokens = parsed(text)
    starts = [i for i, t in enumerate(tokens) if t.type == "heading_open"]
    starts = [i for i in starts if tokens[i].tag in ("h1", "h2")]
    pieces = [html(tokens[: starts[0] if starts else None], figure)]
    for start, stop in pairwise([*starts, len(tokens)]):
        title = html([tokens[start + 1]])
        content = html(tokens[start + 3 : stop], figure)
        pieces.append(
            f"<h2>{title}</h2>{content}"
            if tokens[start].tag == "h1"
            else f"<details><summary>{title}</summary>{content}</details>"
        )
    return "\n".join(pieces)


def shortened(tokens: Sequence[Token]) -> list[Token]:
    """Return tokens without figures and without the later rows of long tables."""
    at = [i for i, t in enumerate(tokens) if t.type == "inline" and _figure_of(t)]
    figures = {i + shift for i in at for shift in (-1, 0, 1)}
    kept: list[Token] = []
    row = 0
    for i, token in enumerate(tokens):
        row = 0 if token.type == "tbody_open" else row + (token.type == "tr_open")
        inside = token.type.startswith(("tr_", "td_")) or token.type == "inline"
        if i not in figures and (row <= _MOST_ROWS or not inside):
            kept.append(token)
        if token.type == "table_close":
            if row > _MOST_ROWS:
                kept += parsed(f"{row - _MOST_ROWS} more rows are not shown.")
            row = 0
    return kept


def _figure_of(token: Token) -> Token | None:
    """Return the image if it is all that a paragraph holds."""
    children = token.children or []
    return children[0] if [c.type for c in children] == ["image"] else None


class _Renderer(RendererHTML):
    """HTML for a page that allows no inline style."""

    def __init__(self, figure: Figure | None):
        super().__init__()
        self._figure = figure

    def table_open(self, tokens: Any, idx: int, options: Any, env: Any) -> str:
        frame = '<div class="wide" tabindex="0" role="group" aria-label="Table">'
        return frame + self.renderToken(tokens, idx, options, env)

    def table_close(self, tokens: Any, idx: int, options: Any, env: Any) -> str:
        return self.renderToken(tokens, idx, options, env) + "</div>"

    def th_open(self, tokens: Any, idx: int, options: Any, env: Any) -> str:
        is_number = tokens[idx].attrs.get("style") == "text-align:right"
        kind = ' class="number"' if is_number else ""
        return f"<{tokens[idx].tag}{kind}>"

    td_open = th_open

    def paragraph_open(self, tokens: Any, idx: int, options: Any, env: Any) -> str:
        figure = self._figure and _figure_of(tokens[idx + 1])
        return "" if figure else self.renderToken(tokens, idx, options, env)

    def paragraph_close(self, tokens: Any, idx: int, options: Any, env: Any) -> str:
        figure = self._figure and _figure_of(tokens[idx - 1])
        return "" if figure else self.renderToken(tokens, idx, options, env)

    def image(self, tokens: Any, idx: int, options: Any, env: Any) -> str:
        if self._figure is None:
            return ""
        text = self.renderInlineAsText(tokens[idx].children, options, env)
        attributes = tokens[idx].attrs
        name, caption = str(attributes["src"]), str(attributes.get("title", ""))
        return self._figure(name, text, caption)
