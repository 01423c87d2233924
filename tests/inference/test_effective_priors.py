"""The zero of several mountings is believed as their mean is, wherever that is asked.

A certificate states the gauge's own zero. Draws stand near the mode: none is sampled.
"""

from dataclasses import asdict, replace

import jax
import numpy as np
import pytest
from rigs import make_case, make_gear, make_records
from scipy import stats
from structures import form_of

from hdcal.calibration.calibrate import _specifics
from hdcal.data.gear_file.certificates import ForceCertificate, certificate_priors
from hdcal.data.priors import Prior, effect_priors
from hdcal.inference import laplace
from hdcal.inference.assembly import assemble
from hdcal.inference.checks import conflict_check
from hdcal.inference.distributions import effective_priors
from hdcal.inference.likelihood import log_prior
from hdcal.inference.marginal import draw_members
from hdcal.inference.posterior import STRUCTURE, Posterior
from hdcal.inference.problem import build_problem, problem_priors
from hdcal.inference.residuals import residuals
from hdcal.inference.sample import Draws

ZERO, SPREAD = "force_offset", "run_offset_sd"
# Zeros of mountings [N]: 1 N on average, far from what the gauge itself may show.
OFFSETS = np.array([2.5, 0.4, 1.8, -0.7])
GAUGE = 0.02
ROWS = 15


def stated_case(expanded: float = 2.0 * GAUGE):
    """Return four mountings on a rig that touches the gear where it says so."""
    gear = make_gear(deformation_offset=Prior("fixed", (0.0,)))
    certificate = {"force_calibration": ForceCertificate(expanded_N=expanded)}
    gear = replace(gear, priors=gear.priors | certificate_priors(certificate))
    x, run = np.tile(np.linspace(0.05, 0.5, ROWS), 4), np.repeat(np.arange(4), ROWS)
    noise = np.random.default_rng(3).normal(0.0, 0.3, len(x))
    force = 209.0 * x + OFFSETS[run] + noise
    return make_case(make_records(x, force, run=run, known={"run"}), gear)


def near_the_mode(problem, chains: int = 2, draws: int = 200) -> Draws:
    """Return draws from the normal law about the mode of a problem."""
    found = laplace.fit(problem)
    shape = (chains, draws)
    rng = np.random.default_rng(0)
    standard = rng.standard_normal((chains * draws, len(found.factor)))

    @jax.jit
    def drawn(standard, keys):
        def one(given):
            values = laplace.values_at(problem, found.position(given[0]))
            return values | draw_members(problem, values, given[1])

        return jax.lax.map(one, (standard, keys))

    values = drawn(standard, jax.random.split(jax.random.key(1), len(standard)))
    values = {n: np.asarray(v).reshape(*shape, *v.shape[1:]) for n, v in values.items()}
    return Draws(
        values=values,
        energy=rng.normal(size=shape),
        potential=rng.normal(size=shape),
        diverging=np.zeros(shape, bool),
        n_steps=np.full(shape, 7),
        acceptance=np.full(shape, 0.9),
        step_size=np.full(shape, 0.5),
        target_acceptance=0.8,
    )


@pytest.fixture(scope="module")
def posterior() -> Posterior:
    case = stated_case()
    shipped, theory = effect_priors(), case.gear.theory
    form = form_of(case)
    problem = build_problem(case, shipped, structure=form)
    found = near_the_mode(problem)
    priors = problem_priors(case, (), shipped, theory)
    own = _specifics(case, theory, problem, form, found, plain=False, shown=False)
    parts = assemble(case, priors, problem, found, own, 2)
    return Posterior(
        case, theory, (), priors, *parts, {"with_gap": False, STRUCTURE: asdict(form)}
    )


def test_the_mean_of_mountings_is_believed_as_wide_as_they_differ():
    law = {ZERO: Prior("normal", (0.3, 0.1)), SPREAD: Prior("half_normal", (2.0,))}
    rng = np.random.default_rng(1)
    gauge = rng.normal(0.3, 0.1, 200_000)
    means = gauge + rng.normal(0.0, 0.7, (4, 200_000)).mean(axis=0)
    found = effective_priors(law, {SPREAD: 0.7}, 4)
    assert found[SPREAD] is law[SPREAD]
    middle, sd = map(float, found[ZERO].numbers)
    assert middle == pytest.approx(means.mean(), abs=3e-3)
    assert sd == pytest.approx(means.std(), rel=1e-2)
    # No certificate, or one mounting: as it is.
    assert effective_priors(law, {}, 0) == law


def test_the_prior_that_is_scaled_is_the_one_that_is_sampled():
    problem = build_problem(stated_case(), effect_priors())
    values = {ZERO: np.float64(0.8), SPREAD: np.float64(0.7)}
    total = float(log_prior(problem, values))
    wanted = stats.halfnorm.logpdf(0.7, scale=problem.priors[SPREAD].numbers[0])
    wanted += stats.norm.logpdf(0.8, 0.0, np.hypot(GAUGE, 0.7 / 2.0))
    assert total == pytest.approx(wanted, rel=1e-9)


def test_data_that_decide_the_zero_are_said_to(posterior):
    """The prior of the gauge alone has it 50 sds away."""
    zero = posterior.diagnoses[ZERO]
    assert np.median(posterior.draws[ZERO]) == pytest.approx(OFFSETS.mean(), abs=0.2)
    assert zero.driven_by == "data" and 0.9 < zero.contraction < 1.0
    checks = {check.name: check.outcome for check in posterior.checks}
    assert checks["prior and data agree"] == "passed"
    notes = [check.words for check in posterior.checks if check.outcome != "passed"]
    assert notes and not any(ZERO in words for words in notes)


def test_what_was_believed_is_shown_so(posterior):
    spread = np.median(posterior.draws[SPREAD]) / 2.0
    law = posterior.effective_priors[ZERO]
    assert float(law.numbers[1]) == pytest.approx(np.hypot(GAUGE, spread))
    shown = posterior.tree["prior"][ZERO].to_numpy()
    assert shown.std() == pytest.approx(float(law.numbers[1]), rel=0.1)
    # What the file keeps is what was given.
    assert posterior.priors[ZERO].numbers == (0.0, GAUGE)


def test_a_zero_of_mountings_is_no_misfit(posterior):
    left = residuals(posterior)
    assert left.structure == () and left.noise == ()


def test_a_zero_that_no_mountings_explain_is_a_conflict(posterior):
    """The check can fail: ten times as far as mountings differ."""
    law = {ZERO: posterior.effective_priors[ZERO]}
    draws = {ZERO: 10.0 * float(law[ZERO].numbers[1]) + posterior.draws[ZERO]}
    assert conflict_check(draws, law).outcome == "warning"
