"""A mirrored question about a mirrored gear has the mirrored design."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from designs import bent, known
from mirrored import check_same, mirrored, turned
from posteriors import batch, single, with_leftover
from slices import slice_of

from hdcal.design import inverse_design as limit_module
from hdcal.design import wave_generator as window_module
from hdcal.design.answer import GeneratorAnswer, InverseAnswer
from hdcal.design.inverse_design import inverse_design
from hdcal.design.study.study import study
from hdcal.design.summary import (
    generator_answer,
    generator_report,
    inverse_answer,
    inverse_report,
)
from hdcal.design.wave_generator import wave_generator
from hdcal.errors import InputError

WINDOW, WALL = (0.38, 0.42), {"wall_thickness_mm": (0.4, 0.9)}
ASKED = {"temperatures": [-20.0, 80.0], "probability": 0.9}
SIZE = 400
GEARS = {
    "one": lambda: single(size=SIZE),
    "of a batch": lambda: batch(6, SIZE),
    "with a leftover": lambda: with_leftover(SIZE),
}


@pytest.fixture
def given(monkeypatch):
    """Let draws stand in for a calibration."""

    def use(draws):
        for module in (window_module, limit_module):
            monkeypatch.setattr(module, "design_draws", lambda source, seed: draws)
        return draws

    return use


def turned_generator(found: GeneratorAnswer) -> GeneratorAnswer:
    """Return a generator that pulls as this one presses."""
    low, high = found.asked.window_mm
    aim, own = found.set_point, found.adjusted

    def swapped(ends):
        return (-ends[1], -ends[0])

    return replace(
        found,
        asked=replace(found.asked, window_mm=(-high, -low)),
        spring=replace(found.spring, interference_mm=-found.spring.interference_mm),
        set_point=replace(
            aim, deformation_mm=-aim.deformation_mm, force_N=turned(aim.force_N)
        ),
        force_N=tuple(
            replace(
                force,
                at_lo=turned(force.at_hi),
                at_middle=turned(force.at_middle),
                at_hi=turned(force.at_lo),
            )
            for force in found.force_N
        ),
        adjusted=replace(
            own,
            interference_mm=swapped(own.interference_mm),
            preload_N=swapped(own.preload_N),
        ),
        stress=replace(found.stress, deformation_mm=-found.stress.deformation_mm),
    )


def turned_inverse(found: InverseAnswer) -> InverseAnswer:
    """Return a design that is pulled as this one is pressed."""

    def candidate(one):
        span = one.force_N
        force = replace(
            span, median=-span.median, lo=-span.hi, hi=-span.lo, kept=-span.kept
        )
        return replace(one, force_N=force)

    asked = replace(found.asked, deformation_mm=-found.asked.deformation_mm)
    return replace(
        found,
        asked=asked,
        design=candidate(found.design),
        tested=candidate(found.tested),
        candidates=tuple(map(candidate, found.candidates)),
    )


@pytest.mark.parametrize("kind", GEARS)
def test_the_spring_for_a_window_is_mirrored(kind: str):
    gear = GEARS[kind]()
    asked = {**ASKED, "setting_sd": 0.003, "probability": 0.95}
    asked["tolerances"] = {"wall_thickness_mm": 0.03}
    found = generator_answer(wave_generator(gear, WINDOW, **asked))
    other = generator_answer(wave_generator(mirrored(gear), (-0.42, -0.38), **asked))
    assert not found.spring.softest_considered
    # Both ends of the window count, and not the same gears miss them.
    assert any(p.zero_backlash != p.no_jam for p in found.at_temperature)
    check_same(asdict(other), asdict(turned_generator(found)))
    assert other.stress.stress_MPa.lo > 0.0
    first, last = other.adjusted.preload_N
    assert first < last < 0.0


@pytest.mark.parametrize("kind", GEARS)
@pytest.mark.parametrize("sign", slice_of([1, -1], [-1]))
def test_the_sizes_for_a_limit_are_mirrored(kind: str, sign: int):
    gear, asked = GEARS[kind](), {**ASKED, "limit_stress": 60.0}
    found = inverse_answer(inverse_design(gear, WALL, 70.0, deformation=0.4, **asked))
    other = inverse_answer(
        inverse_design(mirrored(gear), WALL, sign * 70.0, deformation=-0.4, **asked)
    )
    assert found.design.change > 0.0 and found.design.utilisation_kept > 0.5
    check_same(asdict(other), asdict(turned_inverse(found)))


@pytest.mark.parametrize("kind", GEARS)
def test_the_forces_of_a_study_are_mirrored(kind: str):
    gear, vary = GEARS[kind](), {"wall_thickness_mm": [0.6, 0.7]}
    at = np.array([0.1, 0.4])
    found = study(gear, vary | {"deformation_mm": at}).columns
    other = study(mirrored(gear), vary | {"deformation_mm": -at}).columns
    expected = dict(found)
    expected["deformation_mm"] = -found["deformation_mm"]
    for name, source in (("median", "median"), ("lo", "hi"), ("hi", "lo")):
        expected[f"force_{name}_N"] = -found[f"force_{source}_N"]
    check_same(
        {name: column.tolist() for name, column in other.items()},
        {name: column.tolist() for name, column in expected.items()},
    )
    assert np.all(other["force_lo_N"] < other["force_hi_N"])
    assert np.all(other["stress_MPa"] > 0.0)


@pytest.mark.parametrize("make", [known, bent])
def test_a_study_of_both_senses_holds_each(make):
    draws = make(SIZE)
    sides = window_module.next_gear(draws).forces(np.array([-0.4, 0.4]), np.array([20]))
    np.testing.assert_allclose(sides[0], -sides[1], rtol=1e-12)


@pytest.mark.parametrize("sense", [1, -1])
def test_the_larger_the_limit_the_surer_it_is_kept(given, sense: int):
    draws = given(known(SIZE))
    at = {"deformation": sense * 0.4, "probability": 0.9}
    kept, changes = [], []
    for limit in (50.0, 65.0, 75.0, 80.0, 85.0, 90.0, 120.0):
        found = inverse_design(draws.gear, WALL, limit, **at)
        kept.append(found.tested.kept)
        changes.append(found.chosen.change)
        assert found.chosen.force <= limit * (1.0 + 1e-5)
    assert kept == sorted(kept) and kept[0] == 0.0 and kept[-1] == 1.0
    assert changes == sorted(changes, reverse=True) and changes[-1] == 0.0


@pytest.mark.parametrize("sense", [1, -1])
def test_the_stress_of_either_sense_is_limited(given, sense: int):
    draws = given(known(SIZE))
    at = {"deformation": sense * 0.4, "probability": 0.9}
    free = inverse_design(draws.gear, WALL, 60.0, **at)
    limit = 0.9 * float(np.median(free.chosen.stresses))
    thick = {"wall_thickness_mm": (0.6, 0.9)}
    with pytest.raises(InputError, match="of the allowed stress"):
        inverse_design(draws.gear, thick, 200.0, limit_stress=limit, **at)


def test_a_limit_with_the_other_sign_is_refused(given):
    draws = given(known(SIZE))
    with pytest.raises(InputError, match="Give 60 N, or ask at a negative"):
        inverse_design(draws.gear, WALL, -60.0, deformation=0.4, probability=0.9)


def test_the_words_of_a_generator_that_pulls(given):
    draws = given(known(SIZE))
    found = wave_generator(draws.gear, (-0.42, -0.38), probability=0.9)
    told = generator_report(found)
    said = " ".join([told.answer.headline, *told.answer.answer, told.answer.next_step])
    assert "keeps the gear within -0.42 … -0.38 mm" in said
    assert "To hold the gear at -0.4 mm each side has to pull with 7" in said
    assert "mm inside the undeformed gear" in said and "beyond the" not in said
    assert "At -0.42 mm the smooth wall bends with " in said
    low, high = told.figures()["design"].axes[0].get_xlim()
    assert low < -0.42 and -0.38 < high < 0.0


def test_the_figure_of_a_limit_that_is_pulled_shows_it(given):
    draws = given(known(SIZE))
    found = inverse_design(draws.gear, WALL, 60.0, deformation=-0.4, probability=0.9)
    told = inverse_report(found)
    assert "needs at most 60 N at -0.4 mm" in told.answer.answer[0]
    lines = {line.get_label(): line for line in told.figures()["design"].axes[0].lines}
    assert set(lines["limit"].get_ydata()) == {-60.0}
    chosen = lines["chosen, -60 N with that probability"]
    assert chosen.get_ydata()[0] == pytest.approx(-60.0, rel=1e-5)
    assert np.all(np.asarray(lines["median and 95 % band"].get_ydata()) < 0.0)
