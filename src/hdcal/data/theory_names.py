"""The theories by name: what a gear file may ask for, and what reports call it.

Each has its formula in `hdcal.physics.theory`.
"""

from typing import Literal

Theory = Literal["ring", "cup", "article"]
THEORY_WORDS: dict[str, str] = {
    "ring": "inextensible ring",
    "cup": "cup with a held base",
    "article": "slope plotted in the article",
}
