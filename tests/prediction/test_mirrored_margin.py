"""A mirrored question about mirrored data has the mirrored margin."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from mirrored import check_same, mirrored, turned
from posteriors import (
    batch,
    plain_draws,
    ramp_case,
    single,
    stiffer,
    with_leftover,
    written_posterior,
)
from rigs import make_gear
from slices import slice_of

import hdcal
from hdcal.errors import InputError
from hdcal.prediction.margin.result import Level, Margin
from hdcal.prediction.margin.sentences import headline
from hdcal.prediction.margin.stated import BudgetCheck, BudgetLine

QUICK = {"sensitivities": False}
SIZE = 200


def effect_posterior(size: int = SIZE, **sizes: float):
    """Return one gear, loaded and unloaded, with effects of these parameters."""
    case = ramp_case(known={"unloading", "temperature"}, sense=np.tile([1.0, -1.0], 15))
    given = {name.replace("__", "."): np.full(size, v) for name, v in sizes.items()}
    effects = dict.fromkeys(name.partition(".")[0] for name in given)
    return written_posterior(case, plain_draws(case, size) | given, effects=effects)


def friction():
    loop = {"hysteresis__force": 4.0, "hysteresis__reach": 0.05}
    return effect_posterior(coulomb_friction__force=2.0, **loop)


def zero_drift():
    return effect_posterior(thermal_zero_drift__slope=0.1)


def two_causes():
    gears = batch(6, SIZE)
    return [(3.0, gears), (1.0, stiffer(gears, 1.1))]


def turned_level(level: Level) -> Level:
    return replace(
        level,
        force_N=turned(level.force_N),
        member_N=turned(level.member_N),
        lower_bound_N=-level.upper_bound_N,
        upper_bound_N=-level.lower_bound_N,
    )


# Inputs that do not change their sign with the loading, where the force does.
UNSIGNED = ("%", "1/K", "mm")


def turned_line(line: BudgetLine) -> BudgetLine:
    sign = -1.0 if line.unit in UNSIGNED else 1.0
    words = line.halved_by.replace("readings at 0.6 mm", "readings at -0.6 mm")
    slope = sign * line.sensitivity_N_per_unit
    return replace(line, sensitivity_N_per_unit=slope, halved_by=words)


def turned_check(check: BudgetCheck) -> BudgetCheck:
    return replace(
        check,
        estimate_N=-check.estimate_N,
        lo_N=-check.hi_N,
        hi_N=-check.lo_N,
        monte_carlo_lo_N=-check.monte_carlo_hi_N,
        monte_carlo_hi_N=-check.monte_carlo_lo_N,
    )


def opposite(value):
    return None if value is None else -value


def turned_margin(found: Margin) -> Margin:
    """Return a margin with deformations and forces of the other sign."""
    reached = found.reached
    if reached is not None:
        low, high = reached.searched_mm
        reached = replace(
            reached,
            force_N=-reached.force_N,
            searched_mm=(-high, -low),
            median_mm=opposite(reached.median_mm),
            lo_mm=opposite(reached.hi_mm),
            hi_mm=opposite(reached.lo_mm),
            lower_bound_mm=opposite(reached.upper_bound_mm),
            upper_bound_mm=opposite(reached.lower_bound_mm),
        )
    names = ("bound_N", "force_N", "bound_N_per_percent")
    check = found.linear_check
    return replace(
        found,
        estimate_N=-found.estimate_N,
        coverage_lo_N=-found.coverage_hi_N,
        coverage_hi_N=-found.coverage_lo_N,
        budget=tuple(map(turned_line, found.budget)),
        linear_check=check and turned_check(check),
        deformation_mm=-found.deformation_mm,
        loading_sense=-found.loading_sense,
        levels=tuple(map(turned_level, found.levels)),
        worst=turned_level(found.worst),
        reached=reached,
        models=tuple(
            replace(
                model,
                lower_bound_N=-model.upper_bound_N,
                upper_bound_N=-model.lower_bound_N,
            )
            for model in found.models
        ),
        gradients=tuple(
            replace(slope, **{name: -getattr(slope, name) for name in names})
            for slope in found.gradients
        ),
    )


def mirror(models):
    if isinstance(models, list):
        return [(share, mirrored(model)) for share, model in models]
    return mirrored(models)


def ask(models, asked: dict) -> tuple[Margin, Margin]:
    """Return a margin, and that of the mirrored question about mirrored data."""
    other = asked | {"deformation": -asked["deformation"]}
    if "given_force" in asked:
        other["given_force"] = -asked["given_force"]
    return hdcal.margin(models, **asked), hdcal.margin(mirror(models), **other)


AT = {"deformation": 0.4, "limit_force": 84.0, **QUICK}
WARM = {"temperature": [-20.0, 20.0, 80.0]}
ASKED = {
    "readings": (lambda: single(size=SIZE), AT | WARM | {"given_force": 80.0}),
    "rounded": (lambda: single(make_gear(resolution=0.98), SIZE), AT),
    "load": (lambda: single(size=SIZE), AT | {"quantity": "load", "limit_force": 82.0}),
    "beyond": (
        lambda: single(size=SIZE),
        AT | {"deformation": 0.7, "limit_force": 142.0},
    ),
    "tolerances": (
        lambda: single(size=SIZE),
        AT | {"tolerances": {"wall_thickness_mm": 0.02}},
    ),
    "mountings": (lambda: batch(6, SIZE), AT | {"population": "mountings"}),
    "specimens": (lambda: batch(6, SIZE), AT | WARM | {"given_force": 80.0}),
    "averaged": (two_causes, AT | {"given_force": 80.0}),
    "leftover": (
        lambda: with_leftover(SIZE),
        AT | {"deformation": 0.58, "limit_force": 118.0},
    ),
    "bent": (
        lambda: effect_posterior(progressive_stiffening__slope=0.4),
        AT | {"given_force": 80.0, "limit_force": 94.0},
    ),
    "loading": (friction, AT | {"direction": "up", "given_force": 80.0}),
    "unloading": (friction, AT | {"direction": "down", "given_force": 80.0}),
    "drifting zero": (zero_drift, AT | WARM),
    "with sensitivities": (
        two_causes,
        AT | {"sensitivities": True, "deformation": 0.6, "limit_force": 130.0},
    ),
}
QUICK_ASKED = ("rounded", "averaged", "leftover")


@pytest.mark.parametrize("name", slice_of(ASKED, QUICK_ASKED))
def test_the_answer_is_mirrored(name: str):
    make, asked = ASKED[name]
    found, other = ask(make(), asked)
    assert (found.loading_sense, other.loading_sense) == (1, -1)
    assert found.worst.lower_bound_N < found.worst.upper_bound_N
    assert 0.0 < found.worst.exceedance.probability < 1.0
    expected, given = asdict(turned_margin(found)), asdict(other)
    for answered in (expected, given):
        # Its numbers are compared, with their sign.
        (answered["linear_check"] or {}).pop("words", None)
    check_same(given, expected)
    for words in ("extrapolated", "remarks"):
        assert len(getattr(found, words)) == len(getattr(other, words))
    if "given_force" in asked:
        assert other.reached.lower_bound_mm < other.reached.upper_bound_mm < 0.0


@pytest.fixture(scope="module")
def both_senses():
    """One gear that was pressed, and its mirror image that was pulled."""
    pressed = single(size=SIZE)
    return {1: pressed, -1: mirrored(pressed)}


@pytest.mark.parametrize("sense", [1, -1])
def test_the_larger_the_capacity_the_rarer_it_is_exceeded(both_senses, sense: int):
    names = ("probability", "lo", "hi", "at_confidence")
    ladder = np.arange(60.0, 110.0, 5.0)
    risks = [
        hdcal.margin(both_senses[sense], sense * 0.4, limit_force=limit, **QUICK)
        for limit in ladder
    ]
    for name in names:
        chances = [getattr(found.worst.exceedance, name) for found in risks]
        assert np.all(np.diff(chances) <= 0.0)
        assert chances[0] > 0.999 and chances[-1] < 0.001
    betas = [found.worst.exceedance.beta for found in risks]
    assert betas == sorted(betas)
    enough = ["NOT" not in headline(found) for found in risks]
    # Once it is enough, every larger one is.
    assert enough == sorted(enough) and len(set(enough)) == 2
    needed = {found.worst.capacity_N for found in risks}
    assert len(needed) == 1 and 80.0 < needed.pop() < 90.0


def test_a_capacity_is_a_size_or_has_the_sign_of_the_force(both_senses):
    pulled = both_senses[-1]
    size, sign = (
        hdcal.margin(pulled, -0.4, limit_force=limit, **QUICK) for limit in (70.0, -70)
    )
    assert size == sign and size.limit_force_N == 70.0
    assert size.worst.exceedance.probability > 0.999
    with pytest.raises(InputError, match="Give 70 N, or ask at a negative") as refused:
        hdcal.margin(both_senses[1], 0.4, limit_force=-70.0, **QUICK)
    assert [finding.file for finding in refused.value.findings] == ["limit_force"]


def test_a_force_is_reached_in_its_own_sense_whatever_else_is_asked(both_senses):
    """On data of both senses, each force is found where its own question finds it."""
    case = ramp_case()
    records = case.records
    ends = replace(
        records,
        deformation=np.linspace(-0.54, 0.54, len(records.force)),
        sense=np.tile([1.0, -1.0], 15),
    )
    both = written_posterior(replace(case, records=ends), plain_draws(case, SIZE))
    across = hdcal.margin(both, 0.4, given_force=-80.0, **QUICK).reached
    own = hdcal.margin(both, -0.4, given_force=-80.0, **QUICK).reached
    assert across == own and own.tested
    assert own.lower_bound_mm < own.lo_mm < own.median_mm < own.upper_bound_mm < -0.3


@pytest.mark.parametrize("sense", [1, -1])
def test_a_capacity_is_refused_where_the_zero_is_larger_than_the_load(sense: int):
    posterior = single(size=SIZE)
    tree = posterior.tree.copy(deep=True)
    tree["posterior"]["force_offset"] = tree["posterior"]["force_offset"] - 100.0
    posterior = replace(posterior, tree=tree)
    posterior = posterior if sense > 0 else mirrored(posterior)
    with pytest.raises(InputError, match="Ask for the quantity load") as refused:
        hdcal.margin(posterior, sense * 0.4, limit_force=70.0, **QUICK)
    assert [finding.file for finding in refused.value.findings] == ["limit_force"]
    load = hdcal.margin(
        posterior, sense * 0.4, limit_force=70.0, quantity="load", **QUICK
    )
    assert load.worst.exceedance.probability > 0.999


@pytest.mark.parametrize("sense", [1, -1])
def test_the_sense_is_that_of_the_gear_and_not_of_the_gauge(sense: int):
    """Where the unloaded gear reads 0.1 mm, a reading of 0.05 mm pulls it."""
    posterior = single(size=SIZE)
    tree = posterior.tree.copy(deep=True)
    tree["posterior"]["deformation_offset"] = (
        tree["posterior"]["deformation_offset"] + 0.1
    )
    posterior = replace(posterior, tree=tree)
    posterior = posterior if sense > 0 else mirrored(posterior)
    low, high = (
        hdcal.margin(posterior, sense * at, limit_force=5.0, **QUICK)
        for at in (0.05, 0.15)
    )
    assert (low.loading_sense, high.loading_sense) == (-sense, sense)
    for found in (low, high):
        assert found.worst.exceedance.probability > 0.999
