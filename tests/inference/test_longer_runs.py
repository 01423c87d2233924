"""A run that lacks only draws goes on, on the same way and not without end."""

import numpy as np
import pytest
from rigs import make_case, make_records
from short import TOO_SHORT

from hdcal import calibrate
from hdcal.inference import sample

# As short as a run may be whose lack of draws says something.
ASKED = {"chains": 2, "warmup": 300, "draws": 800}


def case():
    x = np.linspace(0.02, 0.54, 14)
    noise = np.random.default_rng(2).normal(0.0, 0.4, 14)
    return make_case(make_records(x, 205.0 * x - 1.0 + noise))


@pytest.fixture
def told(monkeypatch):
    """Let a list say, look after look, whether chains have mixed."""

    def tell(answers: list[bool]):
        monkeypatch.setattr(sample, "have_mixed", lambda _: answers.pop(0))

    return tell


@pytest.mark.thorough
def test_it_goes_on_where_it_stood(told):
    told([True, True])
    short = calibrate(case(), **ASKED)
    # The first look is for the steps, the others are for the draws.
    told([True, False, False, True])
    longer = calibrate(case(), **ASKED)
    assert short.settings["draws"] == 800 and longer.settings["draws"] == 2400
    for name in ("K", "sigma", "stiffness"):
        drawn = longer.tree["posterior"][name].values
        assert drawn.shape == (2, 2400)
        np.testing.assert_array_equal(
            drawn[:, :800], short.tree["posterior"][name].values
        )


def test_it_comes_to_an_end(told):
    told([True, False, False, False])
    assert calibrate(case(), **ASKED).settings["draws"] == 3200


def test_one_that_diverges_as_it_goes_on_is_repeated_with_shorter_steps(
    told, monkeypatch
):
    class Diverging(sample._Run):
        def found(self):
            drawn = super().found()
            if self._target == 0.8 and drawn.energy.shape[1] > 800:
                drawn.diverging[0, -1] = True
            return drawn

    monkeypatch.setattr(sample, "_Run", Diverging)
    told([True, False, True, True])
    found = calibrate(case(), **ASKED)
    assert found.settings["target_acceptance"] == 0.95
    assert found.settings["draws"] == 800


def test_too_short_a_run_stays_what_was_asked_for():
    assert calibrate(case(), **TOO_SHORT).settings["draws"] == TOO_SHORT["draws"]


@pytest.mark.parametrize("diverging", [True, False])
def test_a_run_is_given_up_at_the_first_divergence(monkeypatch, diverging: bool):
    """After the warm-up, where trajectories may diverge, and only if that is asked."""

    def stretch(problem, whitening, state, target, *, warmup, length):
        kept = [np.zeros(length) for _ in range(7)]
        kept[sample._DIVERGING] = np.full(length, diverging)
        return state, kept

    monkeypatch.setattr(sample, "_start", lambda *_, **__: [])
    monkeypatch.setattr(sample, "_advance", stretch)
    run = sample._Run(None, None, None, 2, 100, None, 0.8)
    run.advance(500, in_vain_if_diverging=True)
    assert run._done == (150 if diverging else 600)
    assert run.kept()[0].shape[1] == (50 if diverging else 500)
    whole = sample._Run(None, None, None, 2, 100, None, 0.8)
    whole.advance(500)
    assert whole._done == 600
