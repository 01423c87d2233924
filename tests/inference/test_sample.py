"""A run that lacks only draws is extended; one that diverges is repeated."""

import numpy as np
import pytest
from rigs import make_case, make_records
from short import SHORT

from hdcal import calibrate
from hdcal.inference import sample
from hdcal.inference.sampled_problem import Sampled

DRAWS = 800


@pytest.fixture
def sampler(monkeypatch):
    """Replace the sampler: which target accepts diverge, and when chains have mixed."""

    def fake(diverging: dict[float, int], mixed: list[bool]):
        def advance(problem, whitening, state, target, *, warmup, length):
            done = state[0]
            at = np.arange(done, done + length) - warmup
            nothing = dict.fromkeys(sample._STATISTICS, np.zeros(length))
            kept = nothing | {"step_size": np.zeros(length)}
            kept["standard"] = at[:, None] * np.ones((length, 2))
            kept["diverging"] = at == diverging.get(target, -1)
            return [done + length], kept

        def constrain(problem, whitening, standard, seed):
            return {"x": standard[..., 0]}

        monkeypatch.setattr(sample, "_start", lambda *_, **__: [0])
        monkeypatch.setattr(sample, "_advance", advance)
        monkeypatch.setattr(sample, "_constrain", constrain)
        monkeypatch.setattr(sample, "have_mixed", lambda _: mixed.pop(0))
        size = {"chains": 2, "warmup": 300, "draws": DRAWS}
        return sample.sample(Sampled(), None, 0, **size)

    return fake


@pytest.mark.parametrize(
    ("diverging", "mixed", "target", "multiple"),
    [
        ({}, [True], 0.8, 1),
        ({}, [False, False, True], 0.8, 3),
        # At most four times the length.
        ({}, [False, False, False, False], 0.8, 4),
        # A divergence, at once or in the extension, repeats the run.
        ({0.8: 30}, [True], 0.95, 1),
        ({0.8: DRAWS + 10}, [False, True], 0.95, 1),
        ({0.8: 5, 0.95: 7}, [True], 0.99, 1),
        # The last one is returned as it is.
        ({0.8: 5, 0.95: 7, 0.99: 9}, [], 0.99, 1),
    ],
)
def test_runs_are_extended_or_repeated(sampler, diverging, mixed, target, multiple):
    found = sampler(diverging, mixed)
    assert found.target_acceptance == target
    assert found.shape == (2, multiple * DRAWS)
    np.testing.assert_array_equal(found.values["x"][1], np.arange(multiple * DRAWS))
    assert found.statistics["diverging"].sum() == (2 if target in diverging else 0)


def test_too_short_a_run_is_not_extended(sampler, monkeypatch):
    monkeypatch.setattr(sample, "_ENOUGH", 10)
    assert sampler({}, []).shape[1] == DRAWS


@pytest.mark.thorough
def test_an_extended_run_begins_with_the_same_draws(monkeypatch):
    x = np.linspace(0.02, 0.54, 14)
    noise = np.random.default_rng(2).normal(0.0, 0.4, 14)
    run = np.arange(14) % 3
    records = make_records(x, 205.0 * x + noise + 0.5 * run, run=run, known={"run"})
    case, size = make_case(records), SHORT | {"chains": 2, "draws": DRAWS}
    runs = []
    for answers in ([True], [False, True]):
        monkeypatch.setattr(sample, "have_mixed", lambda _, a=answers: a.pop(0))
        runs.append(calibrate(case, seed=4, **size).tree["posterior"])
    short, longer = runs
    # The members are integrated out, and drawn again.
    for name in ("K", "sigma", "stiffness", "run_offset"):
        drawn = longer[name].values
        assert drawn.shape[:2] == (2, 2 * DRAWS)
        np.testing.assert_array_equal(drawn[:, :DRAWS], short[name].values)
    monkeypatch.setattr(sample, "have_mixed", lambda _: True)
    other = calibrate(case, seed=5, **size).tree["posterior"]
    assert not np.array_equal(other["K"].values, short["K"].values)
