"""A run that lacks only draws is extended; one that diverges is repeated."""

import numpy as np
import pytest
from rigs import make_case, make_records
from short import TOO_SHORT

from hdcal import calibrate
from hdcal.inference import sample

# As short as a run may be that is extended.
ASKED = {"chains": 2, "warmup": 300, "draws": 800}


def case(runs: int = 1):
    x = np.linspace(0.02, 0.54, 14)
    noise = np.random.default_rng(2).normal(0.0, 0.4, 14)
    run, known = np.arange(14) % runs, {"run"} if runs > 1 else ()
    force = 205.0 * x - 1.0 + noise + 0.5 * run
    return make_case(make_records(x, force, run=run, known=known))


@pytest.fixture
def mixed(monkeypatch):
    """Set whether chains have mixed, look after look."""

    def answer(answers: list[bool]):
        monkeypatch.setattr(sample, "have_mixed", lambda _: answers.pop(0))

    return answer


@pytest.mark.thorough
def test_an_extended_run_begins_with_the_same_draws(mixed):
    mixed([True])
    short = calibrate(case(runs=3), **ASKED)
    mixed([False, False, True])
    longer = calibrate(case(runs=3), **ASKED)
    assert short.settings["draws"] == 800 and longer.settings["draws"] == 2400
    # The members are integrated out, and drawn again.
    for name in ("K", "sigma", "stiffness", "run_offset"):
        drawn = longer.tree["posterior"][name].values
        assert drawn.shape[:2] == (2, 2400)
        np.testing.assert_array_equal(
            drawn[:, :800], short.tree["posterior"][name].values
        )


def test_a_run_is_extended_to_four_times_its_length(mixed):
    mixed([False, False, False])
    assert calibrate(case(), **ASKED).settings["draws"] == 3200


def test_a_divergence_repeats_the_run_with_shorter_steps(mixed, monkeypatch):
    class Diverging(sample._Run):
        def draws(self):
            drawn = super().draws()
            if self._target == 0.8 and drawn.energy.shape[1] > 800:
                drawn.diverging[0, -1] = True
            return drawn

    monkeypatch.setattr(sample, "_Run", Diverging)
    mixed([False, True])
    found = calibrate(case(), **ASKED)
    assert found.settings["target_acceptance"] == 0.95
    assert found.settings["draws"] == 800


def test_too_short_a_run_is_not_extended():
    assert calibrate(case(), **TOO_SHORT).settings["draws"] == TOO_SHORT["draws"]


@pytest.mark.parametrize("diverging", [True, False])
def test_a_run_stops_at_the_first_divergence_after_warmup(monkeypatch, diverging: bool):
    def stretch(problem, whitening, state, target, *, warmup, length):
        kept = [np.zeros(length) for _ in range(7)]
        kept[sample._DIVERGING] = np.full(length, diverging)
        return state, kept

    monkeypatch.setattr(sample, "_start", lambda *_, **__: [])
    monkeypatch.setattr(sample, "_advance", stretch)
    run = sample._Run(None, None, None, 2, 100, None, 0.8)
    run.advance(500, stop_if_diverging=True)
    assert run.diverged == diverging
    assert sum(part[0].shape[1] for part in run._kept) == (50 if diverging else 500)
