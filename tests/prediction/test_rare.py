"""Rare exceedances against their exact probability, and what they rest on."""

from dataclasses import replace

import numpy as np
import pytest
from conjugate import SIGMA, conjugate_case, known_posterior, unit_stiffness
from mirrored import mirrored
from posteriors import with_leftover
from rigs import make_case, make_records
from scipy import stats
from slices import slice_of

import hdcal
from hdcal.calibration.calibrate import calibrate
from hdcal.data.priors import Prior
from hdcal.inference.diagnostics import pareto_shape
from hdcal.prediction.engine.causes import causes_of
from hdcal.prediction.engine.population_force import population_force
from hdcal.prediction.engine.untested import PLACES
from hdcal.prediction.margin import rare as module
from hdcal.prediction.margin.rare import Rare, pooled_rare, rare
from hdcal.prediction.margin.sampling_laws import SamplingLaws

AT = 0.4
SIGMAS = {"Student's t": SIGMA, "normal": Prior("fixed", (0.9,))}
LIMITS = {"Student's t": (85.0, 100.0, 130.0), "normal": (83.0, 84.0, 85.0)}


def case_of(sigma: Prior, rows: int = 6):
    """Return few rows; the law of a further reading is known in closed form."""
    rng = np.random.default_rng(3)
    deformation = np.linspace(0.02, 0.54, rows)
    force = 205.0 * deformation - 3.0 + rng.normal(0.0, 0.9, rows)
    return conjugate_case(deformation, force, sigma)


def exact(case, limit: float) -> float:
    """Return the probability that a further reading exceeds a limit, by quadrature."""
    known, place = known_posterior(case), np.array([AT * unit_stiffness(case), 1.0])
    variance = known.sigma**2 + np.einsum("i,nij,j->n", place, known.covariance, place)
    tail = stats.norm.sf((limit - known.mean @ place) / np.sqrt(variance))
    return float(known.weight @ tail)


def along(force):
    """Return the mixture of every draw along the sense of loading."""
    return force.mixture().along(force.sense)


def counted(force, limit: float) -> float:
    """Return the mean over the sampler's draws."""
    size = force.cause.values["K"].shape
    return float(np.mean(np.asarray(along(force).above(np.full(size, limit)))))


@pytest.mark.parametrize("law", slice_of(SIGMAS, ["Student's t"]))
def test_tails_are_exact_however_far(law):
    case = case_of(SIGMAS[law])
    posterior = calibrate(case, chains=2, warmup=500, draws=1000)
    (cause,), (pulled,) = causes_of(posterior), causes_of(mirrored(posterior))
    force = population_force(cause, AT, "readings")
    for limit in LIMITS[law]:
        found, true = rare(force, limit), exact(case, limit)
        assert 1e-11 < true < 1e-2
        error = abs(found.probability - true)
        assert error < max(5.0 * found.relative_error, 0.01) * true
        assert abs(np.log(found.probability / true)) < 0.05 * abs(np.log(true))
        assert found.relative_error < 0.1
    asked = {"limit_force": limit, "population": "readings", "sensitivities": False}
    risk = hdcal.margin(posterior, AT, **asked).worst.exceedance
    assert risk.probability == pytest.approx(found.probability, rel=0.2)
    assert "importance sampling" in risk.rests_on
    # A gear that is pulled exceeds it in tension.
    other = rare(population_force(pulled, -AT, "readings"), limit).probability
    assert other == pytest.approx(true, rel=5.0 * found.relative_error + 0.01)
    if law == "normal":
        return
    # The comparison can fail: a mean over draws does, where they are too few.
    far = LIMITS[law][-1]
    assert counted(force, far) < 1e-3 * exact(case, far)
    # Six rows leave it to the prior of σ, and to the shape of the scatter.
    assert found.without_prior > 3.0
    assert found.heavy_tailed > 3.0


@pytest.mark.thorough
def test_mountings_and_gaps_are_weighed_as_they_are_sampled():
    """Where draws are enough for a mean, both say the same."""
    rng, run = np.random.default_rng(5), np.repeat(np.arange(4), 10)
    deformation = np.tile(np.linspace(0.02, 0.54, 10), 4)
    force = 205.0 * deformation + rng.normal(0.0, 1.0, 4)[run]
    force = force + rng.normal(0.0, 0.5, 40)
    known = {"run", "runs"}
    case = make_case(make_records(deformation, force, run=run, known=known))
    (cause,) = causes_of(
        calibrate(case, with_gap=True, chains=2, warmup=400, draws=600)
    )
    expected = population_force(cause, AT, "mountings")
    limit = float(np.quantile(np.asarray(along(expected).centre()), 0.9)) + 2.0
    found, mean = rare(expected, limit), counted(expected, limit)
    assert 0.005 < mean < 0.2
    assert found.probability == pytest.approx(mean, rel=0.1)


@pytest.mark.thorough
def test_a_leftover_far_out_is_found_alike_from_every_seed():
    """Its stiffness is far wider than about the mode, where the points begin."""
    rng, deformation = np.random.default_rng(2), np.linspace(0.02, 0.54, 14)
    force = 205.0 * deformation + 20.0 * deformation**2 + rng.normal(0.0, 0.5, 14)
    case = make_case(make_records(deformation, force))
    (cause,) = causes_of(calibrate(case, with_gap=True, draws=500))
    expected = population_force(cause, AT, "readings")
    middle = float(np.median(np.asarray(along(expected).centre())))
    found = [rare(expected, middle + 9.0, seed) for seed in range(4)]
    chances = np.array([one.probability for one in found])
    assert chances.min() > 1e-9 and chances.max() < 1e-3
    assert max(one.relative_error for one in found) < 0.2
    assert np.std(chances) < 0.2 * np.mean(chances)


@pytest.mark.thorough
def test_where_a_fitted_leftover_has_no_part_a_search_has_its_slope(monkeypatch):
    """So far beyond the tested deformation that its share is nothing at all."""
    (cause,) = causes_of(with_leftover())
    force, slopes, towards = (
        population_force(cause, 2.5, "readings"),
        [],
        module._towards,
    )

    def seen(*given):
        height, slope = towards(*given)
        slopes.append(np.asarray(slope))
        return height, slope

    monkeypatch.setattr(module, "_towards", seen)
    limit = float(np.max(np.asarray(along(force).centre()))) + 50.0
    assert rare(force, limit).probability > 0.0
    assert np.isfinite(slopes).all()


def test_weights_with_a_heavy_tail_do_not_tell_their_own_error():
    rng = np.random.default_rng(6)
    for shape in (0.3, 1.2):
        drawn = stats.genpareto(shape).rvs(8000, random_state=rng)
        assert (pareto_shape(drawn) > 0.7) == (shape > 0.7)
        few = np.where(np.arange(8000) < 50, drawn, 0.0)
        assert pareto_shape(few) == np.inf


def test_laws_take_the_shape_of_weighted_points():
    """Of a normal law far narrower than, and beside, where the points were."""
    rng, target = np.random.default_rng(8), stats.multivariate_normal([1.0, -2.0], 0.3)
    wide = (np.zeros(2), 4.0 * np.eye(2))
    laws = SamplingLaws(np.array([True, False, True]), (wide, wide))
    points, log_law = laws.drawn(4096, rng)
    seen = target.logpdf(points[:, [0, 2]]) + stats.norm.logpdf(points[:, 1])
    nowhere = np.full(4096, -np.inf)
    (centre, shape), other = laws.reshaped(points, (seen - log_law, nowhere)).places
    assert centre == pytest.approx(target.mean, abs=0.1)
    assert shape == pytest.approx(target.cov_object.covariance, abs=0.05)
    assert other is wide


@pytest.mark.thorough
def test_what_is_open_is_weighed_too():
    """Where the rig's drift makes the event no draw of the sampler is near it."""
    case = case_of(SIGMAS["normal"])
    (cause,) = causes_of(calibrate(case, chains=2, warmup=300, draws=300))
    warm = population_force(cause, AT, "readings").at(60.0)

    def mean_with(*scores: float) -> np.ndarray:
        places = np.tile(scores, (cause.size, 1))
        values = {**warm.cause.values, PLACES: places}
        there = replace(warm, cause=replace(warm.cause, values=values))
        return np.asarray(along(there).centre())

    middle = mean_with(0.0, 0.0, 0.0)
    shifts = mean_with(0.0, 1.0, 0.0) - middle, mean_with(0.0, 0.0, 1.0) - middle
    sd = np.linalg.norm([0.9 + 0.0 * middle, *shifts], axis=0)
    for limit in (110.0, 130.0):
        found, true = rare(warm, limit), stats.norm.sf((limit - middle) / sd).mean()
        assert 1e-12 < true < 1e-2 and found.relative_error < 0.1
        assert found.probability == pytest.approx(true, rel=0.15)
    assert counted(warm, limit) < 1e-3 * true


@pytest.mark.thorough
def test_at_every_temperature_it_is_refined():
    """The likeliest one counts, and its neighbours do not stay counted."""
    case = case_of(SIGMAS["normal"])
    posterior = calibrate(case, chains=2, warmup=300, draws=600)
    asked = {"limit_force": 130.0, "temperature": [40.0, 60.0, 50.0]}
    found = hdcal.margin(posterior, AT, sensitivities=False, **asked)
    risks = [level.exceedance for level in found.levels]
    chances = [risk.probability for risk in risks]
    assert chances[0] < 0.1 * chances[2] < 0.01 * chances[1]
    assert max(risk.relative_error for risk in risks) < 0.2
    assert all("importance sampling" in risk.rests_on for risk in risks)
    assert found.worst.exceedance.probability == chances[1]
    assert found.worst.exceedance.rests_on == risks[1].rests_on


@pytest.mark.thorough
def test_each_model_alone_is_refined_too():
    """What all say together is the mean of what each says."""
    case = case_of(SIGMAS["normal"])
    size = {"chains": 2, "warmup": 300, "draws": 300}
    two = [(0.7, calibrate(case, **size)), (0.3, calibrate(case, seed=1, **size))]
    found = hdcal.margin(two, AT, sensitivities=False, limit_force=86.0)
    shares, chances = zip(
        *((m.probability, m.probability_exceeded) for m in found.models), strict=True
    )
    risk = found.worst.exceedance
    assert "importance sampling" in risk.rests_on
    assert np.dot(shares, chances) == pytest.approx(risk.probability, rel=1e-6)


@pytest.mark.thorough
def test_causes_are_averaged():
    case = case_of(SIGMAS["normal"])
    (cause,) = causes_of(calibrate(case, chains=2, warmup=300, draws=300))
    force = population_force(cause, AT, "readings")
    near, far = (rare(force, limit) for limit in (85.0, 87.0))
    both = pooled_rare([(0.25, near), (0.75, far)])
    mean = 0.25 * near.probability + 0.75 * far.probability
    assert both.probability == pytest.approx(mean)
    assert 0.0 < both.relative_error < 0.1


def test_what_no_point_reaches_is_nowhere_and_spoils_no_other_cause():
    near = Rare(1e-6, 0.02, 1.0, 2.0)
    nowhere = Rare(0.0, np.nan, np.nan, np.nan)
    both = pooled_rare([(0.25, near), (0.75, nowhere)])
    assert both.probability == pytest.approx(0.25e-6)
    assert both.relative_error == pytest.approx(0.02)
    assert pooled_rare([(1.0, nowhere)]).probability == 0.0
