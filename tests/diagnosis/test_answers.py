"""What a verdict says beside the cause: K, the next run, and why there is nothing."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import judged, rich, simulated
from rigs import make_case, ramp

from hdcal.data.prior import Prior
from hdcal.diagnosis import detection, next_run, weighing
from hdcal.diagnosis.candidate_runs import candidate_runs
from hdcal.diagnosis.verdict import Verdict
from hdcal.evidence.residual_test import residual_test
from hdcal.physics.registry import EFFECTS

CURVED = {"progressive_stiffening": {"slope": 0.1}}
RING = 79.74877882378868  # N/mm, of the test gear at 207 GPa
ENDS = 1.959964  # of a 95 % interval, in sds


@pytest.fixture(scope="module")
def curved() -> Verdict:
    return judged(simulated(ramp(14), CURVED, seed=1))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("prior", "spread"),
    [
        (Prior("normal", (207e3, 3e3)), ENDS * 3.0 / 207.0),
        (Prior("lognormal", (207e3, 0.02)), ENDS * 0.02),
        (Prior("uniform", (200e3, 214e3)), ENDS * 14.0 / 12.0**0.5 / 207.0),
        (Prior("fixed", (207e3,)), 0.0),
    ],
)
def test_the_modulus_is_as_uncertain_as_its_prior(prior, spread):
    found = judged(simulated(ramp(14), seed=2, E0=prior)).budget
    (part,) = (part for part in found.parts if part.name == "modulus")
    assert part.prior.median == pytest.approx(1.0)
    assert np.log(part.prior.hi) == pytest.approx(spread, rel=1e-3, abs=1e-6)
    assert part.factor.hi - part.factor.lo <= 2.01 * spread + 1e-6
    assert ("not free" in part.split_by) == (prior.family == "fixed")


@pytest.mark.thorough
def test_k_is_fitted_beside_the_named_effect():
    effects = {"progressive_stiffening": {"slope": 0.3}}
    verdict = judged(simulated(rich(), effects))
    assert verdict.which.effect == "progressive_stiffening"
    assert verdict.budget.formula == "ring"
    assert verdict.budget.K.lo < 195.0 / RING < verdict.budget.K.hi


@pytest.mark.thorough
def test_k_by_another_theory_is_in_the_note(curved):
    cup = judged(simulated(ramp(14), CURVED, seed=1, theory="cup")).budget
    assert cup.K.median == pytest.approx(curved.budget.K.median, rel=0.3)


def mirrored(records):
    """Return the same loading, read with the other sign."""
    names = ("deformation", "force", "direction", "sense", "rate")
    return replace(records, **{n: -np.asarray(getattr(records, n)) for n in names})


@pytest.mark.thorough
def test_compression_read_as_negative_gets_the_same_runs(curved):
    records = curved.case.records
    runs, others = (
        candidate_runs(records, 20.0),
        candidate_runs(mirrored(records), 20.0),
    )
    for one, other in zip(runs, others, strict=True):
        assert one.words == other.words
        np.testing.assert_allclose(
            one.records.deformation, -other.records.deformation, atol=1e-12
        )
    # Pulling stiffens where pressing softens; every other effect has no such sign.
    library = {n: e for n, e in EFFECTS.items() if n != "large_deflection"}
    both = [
        judged(make_case(each), library=library).next_test
        for each in (records, mirrored(records))
    ]
    # Runs that tell next to the same may change places.
    one, other = ({run.run: run.information_nats for run in each} for each in both)
    assert one.keys() == other.keys()
    for run, told in one.items():
        assert other[run] == pytest.approx(told, abs=0.05)


def test_without_a_run_there_is_a_reason(curved, monkeypatch):
    assert curved.next_test and not curved.no_run
    monkeypatch.setattr(next_run, "_LEAST_NATS", np.inf)
    little = judged(curved.case)
    assert not little.next_test and little.no_run
    monkeypatch.setattr(next_run, "_LEAST_SHARE", 0.8)
    few = judged(curved.case)
    assert not few.next_test and few.no_run


def test_what_is_not_detected_has_no_size():
    verdict = judged(simulated(ramp(14), seed=2))
    assert not verdict.gap.detected
    assert np.isnan(verdict.gap.rms_N.median)
    assert np.isnan(verdict.gap.share_of_full_scale)


def test_a_departure_without_a_cause_has_a_reason_of_its_own(monkeypatch):
    def suspicious(*arguments):
        return replace(residual_test(*arguments), p_value=0.01)

    monkeypatch.setattr(detection, "residual_test", suspicious)
    verdict = judged(simulated(ramp(14), seed=2))
    assert verdict.gap.detected and verdict.which.verdict == "none"


@pytest.mark.thorough
def test_the_step_is_told_where_only_rounding_is_detected():
    records = simulated(ramp(40)).records
    force = 3.0 * np.round(np.asarray(records.force) / 3.0)
    gap = judged(make_case(replace(records, force=force))).gap
    assert gap.detected and gap.rounding_N == pytest.approx(3.0)


def test_a_gap_that_is_seen_is_not_put_down_to_rounding(curved):
    assert curved.gap.detected and curved.gap.rounding_N is None


@pytest.mark.thorough
def test_the_rows_of_a_mean_are_told(monkeypatch):
    monkeypatch.setattr(weighing, "MOST_ROWS", 60)
    verdict = judged(simulated(rich()))
    assert verdict.averaged_rows == 3
    assert len(verdict.where.records.force) < 180 == len(verdict.case.records.force)
