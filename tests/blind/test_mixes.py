"""Cases are what their labels say, and their names and order say nothing."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from hdcal.blind.virtual_rig.cases import draw_cases
from hdcal.blind.virtual_rig.loadings import LOADINGS, Loading
from hdcal.blind.virtual_rig.mixes import MIXES, RIGS, draw_plans, effects_on
from hdcal.blind.virtual_rig.oracle import drawn_curves, oracle_probabilities
from hdcal.blind.virtual_rig.virtual_rig import ALPHA, ALPHA_SD, VirtualRig, draw_noise
from hdcal.errors import InputError

COUNT = 40


@pytest.fixture(scope="module", params=["prior", "withheld", "all"])
def drawn(request):
    return request.param, list(draw_cases(request.param, COUNT, seed=3))


def test_labels_are_those_of_the_files(drawn):
    _, cases = drawn
    assert [label.case for _, label in cases] == [f"case-{i:02}" for i in range(1, 41)]
    for text, label in cases:
        table = np.genfromtxt(text.splitlines(), delimiter=",", names=True, dtype=None)
        assert len(table) == label.rows == len(label.clean)
        error = table["force_N"] - np.array(label.clean)
        if not set(label.truth) & {"outliers", "heteroscedastic_noise", "quantisation"}:
            assert np.std(error) == pytest.approx(label.sigma, rel=0.5)
        seen = np.sqrt(np.mean(np.square(label.curve)))
        if label.kind == "null":
            assert label.truth == () and seen == 0.0
        elif label.kind != "pair" and seen > 0.0:
            assert seen / label.sigma == pytest.approx(label.r, rel=0.01)
        assert (
            set(label.truth) <= set(effects_on(label.program))
            or label.spanned is not None
        )
        whole = sum(label.oracle.values())
        assert whole == pytest.approx(1.0 if label.oracle else 0.0, abs=1e-4)


def test_mixes_hold_what_they_promise(drawn):
    mix, cases = drawn
    kinds = Counter(label.kind for _, label in cases)
    if mix == "withheld":
        assert set(kinds) == {"effect"}
        assert all(set(label.withheld) > set(label.truth) for _, label in cases)
        assert all(len(label.withheld) == 2 for _, label in cases)
    if mix == "all":
        assert {label.mix for _, label in cases} == MIXES.keys() - {"all", RIGS}


def test_the_same_seed_gives_the_same_cases(drawn):
    mix, cases = drawn
    assert list(draw_cases(mix, COUNT, seed=3)) == cases
    assert next(draw_cases(mix, COUNT, seed=4)) != cases[0]


def test_neighbours_are_no_more_alike_than_others():
    """The order is random: agreement of neighbours' names against chance."""
    names = np.array([label.truth for _, label in draw_cases("withheld", 200, 1)])[:, 0]
    same = np.mean(names[1:] == names[:-1])
    assert same < 0.12


def test_the_oracle_is_bayes_rule():
    """Against dense normals whose free columns have a very wide prior instead."""
    loading, rng = LOADINGS["fleet"](), np.random.default_rng(5)
    rig = VirtualRig(loading.history, sigma=0.6)
    made = rig.draw_mechanism("coulomb_friction", 0.5, rng)
    curve = rig.curve(made)
    reading = rig.fault_free + curve + draw_noise(rig, rng, 0.3)
    told = {"truth": "coulomb_friction", "curve": curve, "r": 0.5, "correlation": 0.3}
    found = oracle_probabilities(loading, rig, reading, **told)
    order, run = rig.history.order, rig.history.run
    apart = np.abs(order[:, None] - order)
    serial = np.where(run[:, None] == run, 0.3**apart, 0.0)
    x, rise = rig.history.deformation, rig.history.rise
    base = np.stack([1e3 * x, 1e3 + 0.0 * x, rig.stiffness * ALPHA_SD * x * rise])
    law = multivariate_normal(cov=0.36 * serial + base.T @ base)
    left = reading - replace(rig, alpha=ALPHA).fault_free
    slow = {}
    for name, bank in drawn_curves("fleet").items():
        shapes = 0.5 / rig.gap_over_noise(bank)[:, None] * bank
        if name == "coulomb_friction":
            shapes = np.concatenate([shapes, curve[None]])
        slow[name] = logsumexp(law.logpdf(left - shapes)) - np.log(len(shapes))
    total = logsumexp(list(slow.values()))
    for name, value in slow.items():
        assert found[name] == pytest.approx(np.exp(value - total), abs=0.01)
    loops = ("coulomb_friction", "load_friction", "hysteresis")
    assert set(sorted(found, key=found.get)[-2:]) <= set(loops)
    assert found["coulomb_friction"] > 1.0 / len(found)
    # With the sign of the mechanism turned the true one is no longer to be seen.
    turned = oracle_probabilities(loading, rig, rig.fault_free - curve, **told)
    assert turned["coulomb_friction"] < 0.05


def test_a_program_of_one_s_own_is_gone_through():
    """Nothing else is: what it cannot tell is replaced."""
    own = replace(LOADINGS["ramp"](), name="given")
    for text, label in draw_cases("effects", 12, 5, own):
        table = np.genfromtxt(text.splitlines(), delimiter=",", names=True, dtype=None)
        gone = table["deformation_mm"]
        np.testing.assert_allclose(gone, own.history.deformation, atol=1e-5)
        assert label.program == "given"
        assert {*label.truth} <= {*effects_on("ramp")}


def test_a_program_that_shows_nothing_is_refused():
    whole = LOADINGS["ramp"]().history
    still = replace(whole, deformation=np.full(60, 0.3))
    with pytest.raises(InputError, match="shows next to nothing"):
        list(draw_cases("effects", 3, 5, Loading("given", still)))


def test_cases_are_drawn_in_the_proportions_that_are_said():
    plans = draw_plans("prior", 4000, np.random.default_rng(2))
    kinds = Counter(plan.kind for plan in plans)
    for kind, share in {
        "null": 0.5,
        "outside": 0.1,
        "pair": 0.03,
        "effect": 0.37,
    }.items():
        assert kinds[kind] / 4000 == pytest.approx(share, abs=0.025)
    assert np.mean([plan.noise == "ar" for plan in plans]) == pytest.approx(
        0.25, abs=0.03
    )
    nulls = draw_plans("null", 400, np.random.default_rng(2))
    assert np.mean([plan.noise == "ar" for plan in nulls]) == 0.5
    everything = Counter(
        plan.mix for plan in draw_plans("all", 1000, np.random.default_rng(2))
    )
    assert everything["effects"] == 450
    assert everything["prior"] == 200
