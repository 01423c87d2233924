"""The picture of a fleet's readings: whose are drawn, whole, and that it is said."""

from dataclasses import replace

import numpy as np
import pytest
from fleets import handmade

import hdcal
from hdcal.fleets.curves import MOST_CALLED, MOST_ORDINARY, curve, shown_gears
from hdcal.fleets.figure import curves_figure
from hdcal.fleets.fleet import Fleet
from hdcal.fleets.readings import fleet_readings
from hdcal.fleets.summary import fleet_report
from hdcal.report.document import Picture


def many(gears: int, off: int) -> Fleet:
    """Return gears, the stiffer the later, of which the last ones are called off."""
    found = handmade()
    x = np.tile([0.1, 0.3, 0.2], gears)
    stiffness = 190.0 + np.arange(gears)
    names = [f"G{k:03d}" for k in range(gears)]
    columns = {"deformation_mm": x, "force_N": np.repeat(stiffness, 3) * x}
    case = hdcal.read_case(columns | {"specimen": np.repeat(names, 3)})
    called = np.arange(gears) >= gears - off
    some = {
        name: np.resize(getattr(found, name), gears)
        for name in ("size_ratio", "noise_sd", "own_noise_sd", "zero", "distance")
    }
    return replace(
        found,
        **some | {"size_ratio": np.ones(gears)},
        readings=fleet_readings(case),
        stiffness=np.tile(stiffness, (40, 1)),
        apart=np.zeros((40, gears)),
        loop=np.zeros(gears),
        bend=np.zeros(gears),
        off=np.where(called, 0.9 + 0.001 * np.arange(gears), 0.1),
        chances={name: np.ones(gears) for name in found.chances},
        off_in={name: called & (name == "stiffness") for name in found.off_in},
    )


def caption(found: Fleet) -> str:
    blocks = [b for s in fleet_report(found).document.sections for b in s.blocks]
    pictures = [b for b in blocks if isinstance(b, Picture) and b.name == "curves"]
    return pictures[0].caption


def test_few_gears_are_all_drawn():
    found = handmade()
    shown = shown_gears(found)
    assert (shown.ordinary.tolist(), shown.called.tolist()) == ([0, 1, 2], [3])
    (axes,) = curves_figure(found).axes
    named = [text.get_text() for text in axes.get_legend().get_texts()]
    assert named == ["ordinary gears", "D"]


def test_of_many_gears_an_even_choice_is_drawn_and_said():
    found = many(208, 8)
    shown = shown_gears(found)
    assert len(shown.ordinary) == MOST_ORDINARY and MOST_CALLED == 6
    # From the softest to the stiffest ordinary one, with like steps between them.
    assert shown.ordinary[[0, -1]].tolist() == [0, 199]
    assert set(np.diff(shown.ordinary)) == {3, 4}
    # The surest of those called off are the last.
    assert shown.called.tolist() == [207, 206, 205, 204, 203, 202]
    assert "60 of 200" in caption(found) and "6 of 8" in caption(found)
    assert len(curves_figure(found).axes[0].get_legend().get_texts()) == 7


def test_a_curve_is_each_mounting_in_its_order():
    x, y = curve(many(5, 0), np.array([1, 3]))
    expected = [0.1, 0.3, 0.2, np.nan, 0.1, 0.3, 0.2]
    np.testing.assert_array_equal(x, expected)
    assert y[~np.isnan(y)] == pytest.approx([19.1, 57.3, 38.2, 19.3, 57.9, 38.6])
