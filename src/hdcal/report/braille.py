"""A picture of points for a terminal, in braille: eight dots to a letter."""

from collections.abc import Sequence

import numpy as np

# Bit of the dot in row and column of a letter (Unicode, block "Braille Patterns").
_DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
_FIRST = 0x2800


def scatter_lines(
    x: np.ndarray,
    y: np.ndarray,
    labels: tuple[str, str] = ("", ""),
    size: tuple[int, int] = (60, 14),
) -> Sequence[str]:
    """Return points as lines of text, y upwards, the ends of both axes beside them.

    Args:
        x: shape (n,), finite.
        y: shape (n,), finite.
        labels: of x and y.
        size: columns and lines of letters.
    """
    columns, lines = size
    ends = [(float(values.min()), float(values.max())) for values in (x, y)]
    across, up = (
        np.round((values - low) / ((high - low) or 1.0) * (count - 1)).astype(int)
        for values, (low, high), count in zip(
            (x, y), ends, (2 * columns, 4 * lines), strict=True
        )
    )
    down = 4 * lines - 1 - up
    letters = np.zeros((lines, columns), dtype=int)
    np.bitwise_or.at(letters, (down // 4, across // 2), _DOTS[down % 4, across % 2])
    drawn = ["".join(chr(_FIRST + dots) for dots in line) for line in letters]
    (left, right), (bottom, top) = ([f"{end:.4g}" for end in pair] for pair in ends)
    width = max(len(bottom), len(top))
    beside = [top, *[""] * (lines - 2), bottom]
    picture = [
        f"{text:>{width}} ┤{line}" for text, line in zip(beside, drawn, strict=True)
    ]
    foot = f"{left}{labels[0]:^{columns - len(left) - len(right)}}{right}"
    return [labels[1], *picture, f"{'':{width}}  {foot}"]
