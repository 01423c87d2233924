"""What closes little of a gap is not its cause, whatever noise takes in the rest."""

from dataclasses import replace

import numpy as np
from diagnosis_cases import NOISE, rich, simulated

from hdcal.data.priors import effect_priors
from hdcal.diagnosis.adequacy import leaves_most
from hdcal.diagnosis.amplitude import amplitude_of
from hdcal.evidence.bursts import with_bursts
from hdcal.evidence.case_evidence import QUANTISATION
from hdcal.evidence.compute_evidence import compute_evidence
from hdcal.evidence.parameter_grid import make_grid
from hdcal.evidence.remainder_evidence import with_remainders
from hdcal.evidence.subspaces import shown_shapes
from hdcal.physics.registry import EFFECTS

NAMES = ("coulomb_friction", "progressive_stiffening", "outliers")
LIBRARY = {name: EFFECTS[name] for name in NAMES}


def evidence_of(error):
    case = simulated(rich(), {"coulomb_friction": {"force": 1.5}}, seed=5)
    records = replace(case.records, force=case.records.force + error)
    found = compute_evidence(replace(case, records=records), LIBRARY, effect_priors())
    found = with_remainders(found, np.random.default_rng(0))
    return with_bursts(found, LIBRARY, dict.fromkeys(found.table, 0.0))


def leaves(evidence, hypothesis: str = "coulomb_friction+outliers") -> bool:
    return leaves_most(evidence, hypothesis, "coulomb_friction")


def bursts(size: float):
    """Return six stretches of six readings that are off to one side."""
    error = np.zeros(180)
    for start in range(8, 180, 29):
        error[start : start + 6] = size * NOISE
    return error


def test_readings_struck_one_by_one_are_no_part_of_the_gap():
    error = np.zeros(180)
    error[[11, 40, 73, 101, 150, 166]] = 40.0 * NOISE * np.array([1, -1, 1, 1, -1, 1])
    assert not leaves(evidence_of(error))


def test_what_lasts_is_whatever_noise_takes_it_in():
    assert leaves(evidence_of(bursts(40.0)))
    assert not leaves(evidence_of(bursts(2.0)))


def test_of_two_effects_neither_has_to_close_most():
    lasting = evidence_of(bursts(40.0))
    assert not leaves(lasting, "coulomb_friction+progressive_stiffening")
    assert leaves(lasting, "coulomb_friction+unknown")


def test_what_is_smaller_than_the_rounding_is_a_part_of_it():
    rounded = f"coulomb_friction+{QUANTISATION}"
    plain = evidence_of(0.0)
    plain = replace(plain, table=plain.table | {QUANTISATION: plain.table["none"]})
    assert not leaves(replace(plain, rounding_step=1.0), rounded)
    assert leaves(replace(plain, rounding_step=10.0), rounded)


def test_less_than_a_period_is_a_bend_like_any_other():
    prepared, effect = evidence_of(0.0).prepared, EFFECTS["screw_error"]
    priors = prepared.priors | effect_priors()
    grid = make_grid(effect, priors, kind="subspace")
    assert 0.05 < np.mean(grid.shapes["pitch"] > 0.52) < 0.5
    shown = shown_shapes(grid, prepared)["pitch"]
    assert shown.shape == grid.shapes["pitch"].shape
    each, count = np.unique(shown, return_counts=True)
    own = grid.shapes["pitch"]
    np.testing.assert_array_equal(each, np.sort(own[own <= 0.52]))
    # None stands for much more than another, and neither do the shorter ones together.
    assert count.max() - count.min() <= 1
    half = len(count) // 2
    assert abs(count[:half].mean() - count[half:].mean()) < 0.1
    # A drawing may say that it is longer.
    known = replace(priors["screw_error.pitch"], numbers=(0.6, 0.005))
    grid = make_grid(effect, priors | {"screw_error.pitch": known}, kind="subspace")
    assert shown_shapes(grid, prepared)["pitch"].min() > 0.52


def test_no_shape_that_says_nothing_is_likelier_than_all_that_say_something():
    library = {"screw_error": EFFECTS["screw_error"]}
    for seed in range(3):
        case = simulated(rich(), seed=seed)
        evidence = compute_evidence(case, library, effect_priors())
        found = amplitude_of(evidence, "screw_error", library, np.random.default_rng(0))
        assert found is not None
        assert np.isfinite([found.median, found.lo, found.hi]).all()
