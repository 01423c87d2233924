"""Gains and zeros of certificates leave readings alone, and widen what is true."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from gauged import SDS, certified, told, with_gear
from rigs import cycles, draw_truth, make_case, make_gear, make_records, ramp, simulate
from scipy import stats
from slices import slice_of
from stated_density import log_prior
from structures import form_of

from hdcal.calibration.calibrate import calibrate, choose_effects
from hdcal.data.gear_file.certificates import ForceCertificate, certificate_priors
from hdcal.data.priors import effect_priors
from hdcal.inference.force_model.problem import Problem, build_problem
from hdcal.inference.posterior import Posterior

GAUGES = {"force_gain": 0.02, "deformation_gain": -0.013, "temperature_offset": 7.0}


def several(records):
    """Return three mountings of two gears."""
    rows = len(records.force)
    known = {"run", "runs", "specimen"} | records.known
    run = np.arange(rows) * 3 // rows
    return replace(records, run=run, specimen=run % 2, known=frozenset(known))


KINDS = {
    "compressed, warm": (cycles(), (), {}, False),
    "members": (several(cycles()), (), {}, False),
    "discrepancy": (ramp(30), (), {}, True),
    "rounded": (ramp(), (), {"resolution": 0.98, "reading": "diametral"}, False),
    "effects": (cycles(), ("hysteresis", "thermal_zero_drift"), {}, False),
    "effects, members": (several(cycles()), ("progressive_stiffening",), {}, True),
}


@pytest.mark.parametrize("kind", slice_of(KINDS, ["members", "effects"]))
def test_the_likelihood_of_what_was_read_is_the_same(kind: str):
    records, names, about, with_gap = KINDS[kind]
    effects, case = choose_effects(names), make_case(records, make_gear(**about))
    form = form_of(case, effects, with_gap)
    plain = build_problem(case, effect_priors(), effects, structure=form)
    truth = draw_truth(plain, jax.random.key(1))
    case = simulate(plain, case, truth, jax.random.key(2))
    density, found = jax.jit(Problem.log_likelihood), []
    for gear in (case.gear, certified(case.gear)):
        one = with_gear(case, gear)
        form = form_of(one, effects, with_gap)
        problem = build_problem(one, effect_priors(), effects, structure=form)
        values = told(truth, **GAUGES) if gear.gauge_priors else truth
        found.append(float(density(problem, values)))
    assert found[1] == pytest.approx(found[0], rel=1e-9)
    # The same values without the gains are another likelihood.
    bare = {n: v for n, v in values.items() if n not in GAUGES}
    assert float(density(problem, bare)) != pytest.approx(found[0], rel=1e-6)


def test_mountings_add_to_the_zero_that_a_certificate_states():
    """The zero of n mountings' mean is the gauge's and the mean of n of theirs."""
    certificate = {"force_calibration": ForceCertificate(expanded_N=0.2)}
    gear = make_gear()
    gear = replace(gear, priors=gear.priors | certificate_priors(certificate))
    case = make_case(several(ramp(12)), gear)
    problem = build_problem(case, effect_priors(), structure=form_of(case))
    grid = np.linspace(-3.0, 3.0, 60_001)
    gauge = stats.norm.pdf(grid, 0.0, 0.1)
    spread = {"run_offset_sd": np.float64(0.7)}
    wide = problem.priors["run_offset_sd"].numbers[0]
    for zero in (-0.5, 0.0, 0.8):
        mountings = stats.norm.pdf(zero - grid, 0.0, 0.7 / np.sqrt(3.0))
        density = np.log(np.trapezoid(gauge * mountings, grid))
        density += stats.halfnorm.logpdf(0.7, scale=wide)
        found = float(log_prior(problem, spread | {"force_offset": np.float64(zero)}))
        assert found == pytest.approx(density, rel=1e-6)
    # No certificate, or one mounting: as it is stated.
    for other in (replace(problem, zero_stated=False), replace(problem, runs=0)):
        assert other.priors_given({}) == problem.priors


def precise(gear):
    rng = np.random.default_rng(8)
    deformation = np.tile(np.linspace(0.02, 0.54, 40), 3)
    warm = np.repeat([10.0, 20.0, 30.0], 40)
    force = 205.0 * (1.0 - 3e-4 * (warm - 20.0)) * deformation
    force = force + rng.normal(0.0, 0.3, len(force))
    records = make_records(deformation, force, temperature=warm, known={"temperature"})
    return make_case(records, gear)


@pytest.fixture(scope="module")
def pair() -> tuple[Posterior, Posterior]:
    """The same readings without and with certificates."""
    gear = make_gear()
    return calibrate(precise(gear)), calibrate(precise(certified(gear)))


@pytest.mark.thorough
def test_stiffness_widens_by_the_root_sum_of_squares(pair):
    alone, found = (float(np.log(one.draws["stiffness"]).std()) for one in pair)
    warm = 3e-4 * SDS["temperature_offset"]
    total = np.linalg.norm([alone, SDS["force_gain"], SDS["deformation_gain"], warm])
    # 4000 draws determine an sd to 1 %.
    assert found == pytest.approx(total, rel=0.05)
    assert alone < 0.5 * total
    for name, sd in SDS.items():
        draws = pair[1].draws[name][::4]
        assert stats.kstest(draws, stats.norm(0.0, sd).cdf).pvalue > 1e-3
        assert pair[1].diagnoses[name].driven_by == "prior"
    # The ridge of stiffness and gains is sampled well.
    assert pair[1].usable
    assert min(found.ess_bulk for found in pair[1].diagnoses.values()) > 1000
