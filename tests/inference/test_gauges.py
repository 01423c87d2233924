"""Gains and zeros of certificates leave readings alone, and widen what is true."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from gauged import SDS, certified, told, with_gear
from moving import TRUTH, moving_case, moving_gear
from numpyro.infer.util import log_density
from rigs import cycles, draw_truth, make_case, make_gear, make_records, ramp, simulate
from scipy import stats
from slices import slice_of
from structures import form_of

from hdcal.calibration.calibrate import calibrate, choose_effects
from hdcal.data.gear_file.certificates import (
    GAUGE_UNITS,
    ForceCertificate,
    certificate_priors,
)
from hdcal.data.priors import effect_priors
from hdcal.inference.distributions import distribution
from hdcal.inference.gauges import with_gains
from hdcal.inference.likelihood import log_likelihood
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import build_problem
from hdcal.inference.sampled_problem import model
from hdcal.inference.serial_correlation import CORRELATION
from hdcal.motion.dynamic_problem import (
    build_dynamic,
    dynamic_site_priors,
    predict_motion,
)

GAUGES = {"force_gain": 0.02, "deformation_gain": -0.013, "temperature_offset": 7.0}


def several(records):
    """Return three mountings of two gears."""
    rows = len(records.force)
    known = {"run", "runs", "specimen"} | records.known
    run = np.arange(rows) * 3 // rows
    return replace(records, run=run, specimen=run % 2, known=frozenset(known))


KINDS = {
    "compressed": (ramp(), (), {}, False),
    "compressed, warm": (cycles(), (), {}, False),
    "members": (several(cycles()), (), {}, False),
    "leftover": (ramp(30), (), {}, True),
    "rounded": (ramp(), (), {"resolution": 0.98}, False),
    "diametral": (ramp(), (), {"reading": "diametral"}, False),
    "effects": (cycles(), ("hysteresis", "thermal_zero_drift"), {}, False),
    "effects, members": (several(cycles()), ("progressive_stiffening",), {}, True),
}


@pytest.mark.parametrize("kind", slice_of(KINDS, ["rounded", "effects, members"]))
def test_the_likelihood_of_what_was_read_is_the_same(kind: str):
    records, names, about, with_gap = KINDS[kind]
    effects, case = choose_effects(names), make_case(records, make_gear(**about))
    plain = build_problem(
        case, effect_priors(), effects, structure=form_of(case, effects, with_gap)
    )
    truth = draw_truth(plain, jax.random.key(1))
    case = simulate(plain, case, truth, jax.random.key(2))
    found = []
    for gear in (case.gear, certified(case.gear)):
        one = with_gear(case, gear)
        problem = build_problem(
            one, effect_priors(), effects, structure=form_of(one, effects, with_gap)
        )
        values = told(truth, **GAUGES) if gear.gauge_priors else truth
        found.append(float(log_likelihood(problem, values)))
        # The same values without the gains are another likelihood.
        bare = {n: v for n, v in values.items() if n not in GAUGES}
        moved = float(log_likelihood(problem, bare))
        assert (moved == found[-1]) == (not gear.gauge_priors)
    assert found[1] == pytest.approx(found[0], rel=1e-9)


def test_the_prior_of_the_coefficient_stays_exact():
    case = make_case(ramp(), certified())
    problem = build_problem(case, effect_priors(), structure=form_of(case))
    values = draw_truth(problem, jax.random.key(3))
    seen = values["E0"] * (1.0 + values["force_gain"])
    seen /= 1.0 + values["deformation_gain"]
    sites = ["E0", *GAUGE_UNITS, "alpha", "force_offset", "deformation_offset"]
    given = {name: values[name] for name in sites} | {"_KE0": values["K"] * seen}
    given[CORRELATION] = values[CORRELATION]
    added = np.sqrt(1.0 - values[CORRELATION] ** 2)
    given["_added_sd"] = values["sigma"] * added
    total = float(log_density(model, (problem,), {}, given)[0])
    wanted = float(log_likelihood(problem, values)) - np.log(seen * added)
    for name in (*sites, "K", "sigma", CORRELATION):
        law = distribution(problem.priors[name], name)
        wanted += float(law.log_prob(values[name]))
    assert total == pytest.approx(wanted, rel=1e-10)


def zeroed(gear):
    """Return a gear whose force gauge has a certificate of its zero."""
    stated = {"force_calibration": ForceCertificate(expanded_N=0.2)}
    return replace(gear, priors=gear.priors | certificate_priors(stated))


def of_mean(zero: float) -> float:
    """Return the density of the mean of three mountings' zeros on such a gauge."""
    grid = np.linspace(-1.0, 1.0, 20_001)
    gauge = stats.norm.pdf(grid, 0.0, 0.1)
    mountings = stats.norm.pdf(zero - grid, 0.0, 0.7 / np.sqrt(3.0))
    return float(np.trapezoid(gauge * mountings, grid))


def test_mountings_add_to_the_zero_that_a_certificate_states():
    """The zero of n mountings' mean is the gauge's and the mean of n of theirs."""
    case = make_case(several(ramp(12)), zeroed(make_gear()))
    shipped = effect_priors()
    stated = build_problem(case, shipped, structure=form_of(case))
    plain = replace(stated, zero_stated=False)
    truth = draw_truth(stated, jax.random.key(4)) | {"run_offset_sd": np.float64(0.7)}
    names = {*stated.priors} - {"K", "gap_sd", "gap_length", CORRELATION}
    for zero in (-0.5, 0.0, 0.8):
        given = {name: truth[name] for name in names}
        given |= {"_KE0": truth["K"] * truth["E0"], "force_offset": np.float64(zero)}
        given[CORRELATION] = np.float64(0.5)
        given["_added_sd"] = given.pop("sigma")
        added = [
            float(log_density(model, (one,), {}, given)[0]) for one in (stated, plain)
        ]
        wanted = np.log(of_mean(zero)) - stats.norm.logpdf(zero, 0.0, 0.1)
        assert added[0] - added[1] == pytest.approx(wanted, rel=1e-6)


def test_a_moving_gear_reads_the_same():
    case = moving_case(1)
    problems = [
        build_dynamic(one, dynamic_site_priors(one, "ring"), "ring")
        for one in (case, with_gear(case, certified(moving_gear())))
    ]
    start = {"alpha": 3e-4, "initial_deformation": 0.2, "initial_velocity": 0.0}
    values = {**TRUTH, **start}
    moved = told(values, **GAUGES)
    # A gauge that shows more force shows more mass.
    moved["mass"] = values["mass"] / with_gains(moved, 1.0)
    found = [
        np.asarray(predict_motion(one, v))
        for one, v in zip(problems, (values, moved), strict=True)
    ]
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9)
    assert problems[1].priors.keys() - problems[0].priors.keys() == SDS.keys()


def precise(gear):
    rng = np.random.default_rng(8)
    deformation = np.tile(np.linspace(0.02, 0.54, 40), 3)
    warm = np.repeat([10.0, 20.0, 30.0], 40)
    force = 205.0 * (1.0 - 3e-4 * (warm - 20.0)) * deformation
    force = force + rng.normal(0.0, 0.3, len(force))
    records = make_records(deformation, force, temperature=warm, known={"temperature"})
    return make_case(records, gear)


def spread(posterior) -> float:
    return float(np.log(posterior.draws["stiffness"]).std())


def adds_up(found: float, alone: float) -> bool:
    """Tell whether an sd of the log stiffness is that of the data and all gauges."""
    warm = 3e-4 * SDS["temperature_offset"]
    gains = SDS["force_gain"], SDS["deformation_gain"], warm
    # 4000 draws tell an sd to 1 %.
    return abs(found / np.linalg.norm([alone, *gains]) - 1.0) < 0.05


@pytest.fixture(scope="module")
def pair() -> tuple[Posterior, Posterior]:
    """The same readings without and with certificates."""
    gear = make_gear()
    return calibrate(precise(gear)), calibrate(precise(certified(gear)))


@pytest.mark.thorough
def test_stiffness_widens_by_the_root_sum_of_squares(pair):
    plain, stated = pair
    assert plain.usable and stated.usable
    alone = spread(plain)
    assert adds_up(spread(stated), alone)
    # Gains that are ignored do not.
    assert not adds_up(alone, alone)


@pytest.mark.thorough
def test_the_ridge_is_sampled_well(pair):
    for name, found in pair[1].diagnoses.items():
        # The correlation of the noise is no part of the ridge.
        assert found.ess_bulk > (1000 if name == CORRELATION else 2000), name
        assert (found.driven_by == "prior") or name not in GAUGE_UNITS
    assert np.mean(pair[1].tree["sample_stats"]["n_steps"]) < 16


@pytest.mark.thorough
def test_gauges_stay_where_their_certificates_put_them(pair):
    for name, sd in SDS.items():
        draws = pair[1].draws[name]
        assert stats.kstest(draws[::4], stats.norm(0.0, sd).cdf).pvalue > 1e-3


@pytest.mark.thorough
def test_a_posterior_keeps_its_certificates(pair, tmp_path):
    pair[1].save(tmp_path / "posterior.nc")
    back = Posterior.load(tmp_path / "posterior.nc")
    assert back.case.gear.gauge_priors.keys() == SDS.keys()
    for name in SDS:
        assert back.priors[name].numbers == pair[1].priors[name].numbers
        np.testing.assert_array_equal(back.draws[name], pair[1].draws[name])
