"""The theories by name: what a gear file may ask for, and what reports call it.

Each has its formula in `hdcal.physics.theory`. Under `SPRING` K is the stiffness
itself: it needs no sizes, and no other theory says what its K would be.
"""

from typing import Literal

Theory = Literal["ring", "cup", "article", "spring"]
SPRING: Theory = "spring"
THEORY_WORDS: dict[str, str] = {
    "ring": "inextensible ring",
    "cup": "cup with a held base",
    "article": "slope plotted in the article",
    "spring": "a stiffness without sizes",
}
# What a deformation may be as it is read.
READINGS = "radial", "diametral"
