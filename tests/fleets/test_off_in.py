"""A gear may be off in noise, zero or shape, and ordinary ones seldom are."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest

import hdcal
from hdcal.fleets.gear_sums import MountingSums
from hdcal.fleets.off_in import FALSE_CALLS, called_off, chance_of, zero_chance
from hdcal.fleets.own_shapes import own_shapes
from hdcal.fleets.summary import fleet_answer, gear_columns

UP = np.linspace(0.05, 0.5, 8)
X, GEARS, RUNS = np.concatenate([UP, UP[-2::-1]]), 12, 2
# Shapes of a loop, and of a bend whose middle lies under its ends.
WAY = np.repeat([1.0, -1.0], [len(UP), len(UP) - 1])
CURVE = 4.0 * (X - UP.mean()) ** 2 / np.ptp(UP) ** 2


def measured(
    seed: int = 0,
    noise: float = 1.0,
    zero: float = 0.0,
    loop: float = 0.0,
    bend: float = 0.0,
    shared: float = 0.0,
):
    """Return gears of which the first has another noise, zero, loop and bend.

    All of them have a loop and a bend that they share.
    """
    rng = np.random.default_rng(seed)
    gear, run, row = (i.ravel() for i in np.indices((GEARS, RUNS, len(X))))
    stiffness = 200.0 * (1.0 + 0.01 * rng.standard_normal(GEARS))
    zeros = 0.8 * rng.standard_normal((GEARS, RUNS))
    zeros[0] += zero
    sd = 0.4 * np.where(gear == 0, noise, 1.0)
    force = stiffness[gear] * X[row] + zeros[gear, run]
    own = (gear == 0) * (0.5 * loop * WAY + bend * CURVE)[row]
    force += own + shared * (0.5 * WAY + CURVE)[row]
    names = np.array([f"G{one}" for one in range(GEARS)])
    table = {"specimen": names[gear], "run": run, "deformation_mm": X[row]}
    table["force_N"] = force + sd * rng.standard_normal(len(force))
    return hdcal.fleet(hdcal.read_case(table, theory="spring"))


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("noise", {"noise": 4.0}),
        ("zero", {"zero": 8.0}),
        ("shape", {"loop": 1.5}),
        ("shape", {"bend": 2.2}),
    ],
)
def test_what_a_gear_is_off_in_is_told(kind: str, change: dict):
    found = measured(**change)
    told = {name: own.nonzero()[0].tolist() for name, own in found.off_in.items()}
    assert told == {"stiffness": [], "noise": [], "zero": [], "shape": [], kind: [0]}
    answer, columns = fleet_answer(found), gear_columns(found)
    assert answer.called_off == ("G0",) and answer.off_in[kind] == ("G0",)
    assert kind in columns["off_in"][0].split(", ") and not any(columns["off_in"][1:])


def test_the_size_of_loop_and_bend_is_told():
    found = measured(loop=2.0, bend=3.0)
    assert found.loop[0] == pytest.approx(2.0, abs=0.4)
    assert found.bend[0] == pytest.approx(3.0, abs=0.6)
    assert np.all(np.abs(found.loop[1:]) < 0.6)
    assert np.all(np.abs(found.bend[1:]) < 0.6)


def test_a_shape_that_all_gears_have_is_no_gears_own():
    found = measured(seed=1, shared=2.0)
    assert np.median(found.loop) == pytest.approx(2.0, abs=0.3)
    assert not found.off_in["shape"].any()
    assert measured(seed=1, shared=2.0, loop=2.0).off_in["shape"].tolist() == (
        [True] + [False] * (GEARS - 1)
    )


def test_ordinary_gears_are_seldom_called_for_their_shape():
    """Of the whole 5 % a tenth, as noise and zero."""
    rng, fleets, called = np.random.default_rng(5), 1500, 0
    gear, run, row = (i.ravel() for i in np.indices((12, 2, len(X))))
    names = {"specimen": np.array([f"G{one}" for one in range(12)])[gear], "run": run}
    table = names | {"deformation_mm": X[row], "force_N": 200.0 * X[row]}
    case = hdcal.read_case(table, theory="spring")
    line = np.asarray(case.records.force)
    for _ in range(fleets):
        force = line + rng.standard_normal(len(line))
        one = replace(case, records=replace(case.records, force=force))
        found = own_shapes(one)
        called += called_off({"shape": found.chance})["shape"].any()
    assert called / fleets < 0.1 * FALSE_CALLS


@pytest.mark.parametrize("kind", ["noise", "zero"])
def test_ordinary_gears_are_called_in_few_fleets(kind: str):
    """Of the whole 5 % a tenth is for each of these two."""
    rng, fleets, called = np.random.default_rng(3), 4000, 0
    for _ in range(fleets):
        apart = rng.standard_normal(12)
        apart -= np.median(apart)
        extremes = np.abs(apart) if kind == "zero" else apart
        chance = chance_of(apart, extremes, np.zeros(12))
        called += called_off({kind: chance})[kind].any()
    assert binomtest(int(called), fleets, 0.1 * FALSE_CALLS).pvalue > 0.01


def test_gears_of_which_less_is_known_are_called_no_more():
    """One of few readings, among gears of many."""
    rng, fleets, called = np.random.default_rng(6), 4000, 0
    error = np.array([0.5, *[0.01] * 11])
    for _ in range(fleets):
        noise = rng.normal(0.0, np.sqrt(0.1**2 + error))
        called += called_off({"noise": chance_of(noise, noise, error)})["noise"][0]
    assert called / fleets < 0.1 * FALSE_CALLS


@pytest.mark.thorough
def test_a_gear_that_was_mounted_once_is_called_no_more():
    """Its zero lies as far from all others as one mounting's does."""
    rng, fleets, called = np.random.default_rng(7), 4000, 0
    gear = np.repeat(np.arange(12), [1, *[9] * 11])
    none = np.zeros(len(gear))
    draws = {"zero": np.zeros(2)}
    for _ in range(fleets):
        zeros = rng.standard_normal(len(gear))
        nobody = none.astype(int)
        sums = MountingSums(
            gear, 6.0 + none, none, zeros, none, none, none, nobody, nobody
        )
        chance = zero_chance(sums, draws, np.ones((2, 12)), np.zeros(12))
        called += called_off({"zero": chance})["zero"][0]
    assert called / fleets < 0.1 * FALSE_CALLS


def test_gears_that_are_off_do_not_hide_each_other():
    apart = np.random.default_rng(4).standard_normal(30)
    apart[:3] = 12.0, 13.0, -14.0
    chance = chance_of(apart, np.abs(apart), np.zeros(30))
    assert called_off({"zero": chance})["zero"].nonzero()[0].tolist() == [0, 1, 2]
    # Less scatter than their own errors make is none.
    assert not called_off({"zero": chance_of(apart, np.abs(apart), np.full(30, 50.0))})[
        "zero"
    ].any()
