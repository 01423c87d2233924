"""A small seeded slice of the blind check: hdcal beats those who know less."""

import numpy as np
import pytest

from hdcal.blind.answering import answer_set
from hdcal.blind.open import open_set
from hdcal.blind.scoring.scores import Scores
from hdcal.blind.sealed_set import write_set
from hdcal.blind.virtual_rig.cases import GEAR_TOML, draw_cases
from hdcal.physics.registry import EFFECTS

# Cases of every size, drawn as the diagnosis expects; enough for scores, not for rates.
CASES, SEED = 16, 20


@pytest.fixture(scope="module")
def scores(tmp_path_factory) -> Scores:
    folder = tmp_path_factory.mktemp("slice") / "set"
    key = folder.with_suffix(".key")
    drawn = draw_cases("prior", CASES, SEED)
    write_set(folder, drawn, GEAR_TOML, key, mix="prior", seed=SEED)
    for name in ("hdcal", "bic", "r2", "none"):
        answer_set(folder, by=name)
    return open_set(folder, key).report.answer


def guess(label) -> float:
    """Return the Brier score of who only knows how cases are drawn."""
    many = len(EFFECTS)
    shares = {"null": 0.5, "outside": 0.1, "effect": 0.37 / many}
    # Each of the many pairs has next to nothing.
    others = 0.5**2 + 0.1**2 + many * shares["effect"] ** 2
    own = shares.get(label.kind, 0.0)
    return others - own**2 + (1.0 - own) ** 2


@pytest.mark.thorough
def test_its_scores_are_best(scores):
    """Better than the rivals', and by a tenth than knowing how the cases were drawn.

    Of so few cases a bounded score tells: a single one that is surely wrong decides the
    mean of logarithms, which is compared with those of the rivals only.
    """
    logs = {name: each.value for name, each in scores.log_score.items()}
    assert max(logs, key=lambda name: logs[name]) == "hdcal"
    squares = {name: each.value for name, each in scores.brier.items()}
    known = np.mean([guess(c) for _, c in draw_cases("prior", CASES, SEED)])
    better = {name for name, value in squares.items() if value < 0.9 * known}
    assert better == {"hdcal"}, (squares, known)


@pytest.mark.thorough
def test_it_names_nothing_where_nothing_is(scores):
    rows = {row.key: row for row in scores.bar}
    assert rows["named_on_null"].n >= 4
    assert rows["named_on_null"].value == 0.0
