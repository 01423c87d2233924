"""Priors of any family that a gear file states are those of the evidence."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import judged
from rigs import cycles, make_case, make_gear

from hdcal.data.case import Case
from hdcal.data.prior import Prior
from hdcal.evidence.components import components
from hdcal.evidence.linear_problem import linear_problem
from hdcal.evidence.noise_models import growing_noise, outliers
from hdcal.evidence.remainder import remainder_space
from hdcal.physics.registry import EFFECTS

NAMES = "coulomb_friction", "screw_error", "run_offset", "outliers"
LIBRARY = {name: EFFECTS[name] for name in (*NAMES, "heteroscedastic_noise")}
WIDE = Prior("uniform", (0.01, 0.05))
OTHER = [WIDE, Prior("lognormal", (0.03, 0.5)), Prior("half_normal", (0.03,))]
OTHER += [Prior("fixed", (0.03,)), Prior("normal", (0.03, 0.01))]


def case_with(**priors: Prior) -> Case:
    """Return noisy readings of a gear that states priors; `__` stands for a point."""
    stated = {name.replace("__", "."): prior for name, prior in priors.items()}
    effects = {name: prior for name, prior in stated.items() if "." in name}
    scales = {n: prior for n, prior in stated.items() if n not in effects}
    gear = replace(make_gear(**scales), effect_priors=effects)
    records = cycles(48)
    runs = replace(records, run=np.arange(48) // 12, known=records.known | {"runs"})
    force = 195.0 * runs.deformation + np.random.default_rng(1).normal(0.0, 0.4, 48)
    return make_case(replace(runs, force=force), gear)


def problem_with(**priors: Prior):
    return linear_problem(case_with(**priors), LIBRARY, noise_sd=0.4)


@pytest.mark.parametrize("prior", OTHER, ids=lambda prior: prior.family)
def test_a_share_of_outliers_has_any_family(prior: Prior):
    beta = problem_with(outliers__fraction=Prior("beta", (3.0, 97.0)))
    (expected,), (found,) = (
        outliers(problem, 0.0, lambda weight, y=problem.y: 0.0 * y)
        for problem in (beta, problem_with(outliers__fraction=prior))
    )
    assert found.log_prior == pytest.approx(expected.log_prior, abs=3.0)
    assert found.log_prior < 0.0


@pytest.mark.parametrize("prior", OTHER, ids=lambda prior: prior.family)
def test_a_share_of_the_noise_has_any_family(prior: Prior):
    problem = problem_with(heteroscedastic_noise__share=prior)
    total = sum(np.exp(model.log_prior) for model in growing_noise(problem, 0.0))
    assert 0.0 < total < 0.0201


def test_a_fixed_share_of_the_noise_has_its_size():
    problem = problem_with(heteroscedastic_noise__share=Prior("fixed", (0.003,)))
    (model,) = growing_noise(problem, 0.0)
    distance = np.asarray(problem.records.deformation) - problem.base.deformation_offset
    load = float(problem.base.stiffness) * np.abs(distance)
    grown, constant = np.polyfit(load**2, model.weight**-2.0, 1)
    whole = grown * np.mean(load**2) + constant
    assert 0.4 * np.sqrt(grown / whole) == pytest.approx(0.003, rel=1e-6)


def test_a_scale_of_the_remainder_is_the_rms_of_its_prior():
    column = np.ones((1, 48))
    families = {
        Prior("half_normal", (3.0,)): 3.0,
        Prior("fixed", (3.0,)): 3.0,
        Prior("uniform", (0.0, 6.0)): 12.0**0.5,
        Prior("lognormal", (3.0, 0.5)): 3.0 * np.exp(0.25),
    }
    for prior, size in families.items():
        space = remainder_space(problem_with(gap_sd=prior), 0, column)
        assert space.scale[5] == pytest.approx(size)


@pytest.mark.parametrize(
    ("prior", "middle"),
    [
        (Prior("half_normal", (0.3,)), 0.3),
        (Prior("fixed", (0.3,)), 0.3),
        (Prior("lognormal", (0.3, 1.0)), 0.3),
    ],
    ids=["half_normal", "fixed", "lognormal"],
)
def test_the_spread_of_runs_is_that_of_the_gear_file(prior: Prior, middle: float):
    runs = {"run_offset": EFFECTS["run_offset"]}
    (space,) = components(runs, problem_with(run_offset_sd=prior)).spaces
    chance = np.exp(space.log_weight)
    assert chance.sum() == pytest.approx(1.0)
    typical = np.exp(chance @ np.log(space.scale))
    assert typical == pytest.approx(middle, rel=0.5)


def test_an_effect_whose_amplitudes_are_fixed_at_zero_is_excluded():
    none = Prior("fixed", (0.0,))
    found = judged(
        case_with(
            coulomb_friction__force=none,
            screw_error__sine=none,
            screw_error__cosine=none,
            outliers__fraction=none,
        ),
        library=LIBRARY,
    )
    assert {*found.which.inclusion} == {"run_offset", "heteroscedastic_noise"}
    assert sum("is excluded" in note for note in found.data.notes) == 3


def test_a_fixed_amplitude_has_its_size():
    fixed = problem_with(
        coulomb_friction__force=Prior("fixed", (2.0,)),
        screw_error__sine=Prior("fixed", (0.0,)),
    )
    found = components({n: EFFECTS[n] for n in NAMES[:2]}, fixed)
    (low,), (high,) = found.atoms.amplitude.low, found.atoms.amplitude.high
    assert low < 2.0 < high < 1.01 * low
    sine, cosine = found.spaces[0].columns
    assert not sine.any() and cosine.any()
