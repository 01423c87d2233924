"""The theories of `hdcal.physics.theory` by name; `SPRING` has a stiffness alone."""

from typing import Literal

Theory = Literal["ring", "cup", "article", "spring"]
SPRING: Theory = "spring"
THEORY_WORDS: dict[str, str] = {
    "ring": "inextensible ring",
    "cup": "cup with a held base",
    "article": "slope plotted in the article",
    "spring": "a stiffness without sizes",
}
READINGS = "radial", "diametral"  # what a deformation may be as it is read
