"""Random exports are read as they are meant, or asked about; none is read wrongly."""

import random

import numpy as np
import pytest

from hdcal.data.reading import read_case
from hdcal.errors import InputError

DEFORMATIONS = [("Weg", "mm", 1.0), ("Extension", "um", 1e-3), ("Travel", "in", 25.4)]
FORCES = [("Kraft", "N", 1.0), ("Load", "kN", 1e3), ("Axial Force", "gf", 9.80665e-3)]
OTHERS = [("Kraft Sollwert", "N"), ("Position", "mm"), ("Pressure", "bar")]
OTHERS += [("Index", ""), ("Strain-FL", "με"), ("Force rate", "N/s")]
TITLES = ["Test report 12", "Operator: M. K.", "Gauge{}7{}mm", "v1{}1{}mm/min", ""]
STYLES = {
    "brackets": "{} [{}]",
    "parentheses": "{} ({})",
    "slash": "{} / {}",
    "word": "{} in {}",
    "row of units": "{}",
}


class Export:
    """A file as some program may write it."""

    def __init__(self, seed: int):
        draw, noise = random.Random(seed), np.random.default_rng(seed)
        count = draw.choice([8, 30, 120])
        self.deformation = np.linspace(0.0, 1.0, count) + noise.normal(0, 1e-3, count)
        self.force = 50.0 * self.deformation + noise.normal(0, 0.1, count)
        x, force = draw.choice(DEFORMATIONS), draw.choice(FORCES)
        columns = [
            (*x[:2], self.deformation / x[2]),
            (*force[:2], self.force / force[2]),
        ]
        for name, unit in draw.sample(OTHERS, draw.randrange(3)):
            columns.append((name, unit, noise.normal(5.0, 1.0, count)))
        # A gauge that is called by its number may be the one that is meant.
        self.ambiguous = draw.random() < 0.15
        if self.ambiguous:
            columns.append((str(draw.randint(10**5, 10**6)), "mm", self.deformation))
        draw.shuffle(columns)
        separator = draw.choice(",;\t|")
        decimal = draw.choice(".,") if separator != "," else "."
        self.text = self._text(draw, columns, separator, decimal)

    def _text(self, draw: random.Random, columns, separator: str, decimal: str) -> str:
        style = draw.choice([*STYLES])
        names = [STYLES[style].format(n, u) if u else n for n, u, _ in columns]
        head = [names]
        if style == "row of units":
            head.append([unit for _, unit, _ in columns])
        cells = zip(*(values for *_, values in columns), strict=True)
        body = [[f"{cell:.9f}".replace(".", decimal) for cell in row] for row in cells]
        if draw.random() < 0.2:
            middle = len(body) // 2
            body = [*body[:middle], ["Block 2"], *head, *body[middle:]]
        mark = '"' if draw.random() < 0.2 else ""
        titles = draw.sample(TITLES, draw.randrange(4))
        lines = [title.format(separator, separator) for title in titles]
        lines += [separator.join(f"{mark}{c}{mark}" for c in r) for r in [*head, *body]]
        lines += draw.choice([[], ["End of test"], ["", "Operator: M. K."]])
        return draw.choice(["\n", "\r\n"]).join(lines) + "\n"


@pytest.mark.parametrize("seed", range(80))
def test_a_random_export_is_read_or_asked_about(tmp_path, seed):
    export = Export(seed)
    (tmp_path / "log.txt").write_bytes(export.text.encode())
    if export.ambiguous:
        with pytest.raises(InputError, match="the deformation may be"):
            read_case(tmp_path / "log.txt")
        return
    records = read_case(tmp_path / "log.txt").records
    np.testing.assert_allclose(records.deformation, export.deformation, atol=1e-6)
    np.testing.assert_allclose(records.force, export.force, atol=1e-5)
