"""Each fault of a record is found, at its rows and with its size."""

import numpy as np
import pytest

from hdcal.quantities import FORCE
from hdcal.screening.result import SEGMENTS, Observation
from hdcal.screening.screen import screen
from hdcal.screening.words import in_words

RNG = np.random.default_rng(8)
START = RNG.bit_generator.state
STIFFNESS = 20.0


@pytest.fixture(autouse=True)
def same_numbers():
    """Let the numbers of a test not depend on which tests ran before it."""
    RNG.bit_generator.state = START


def ramp(rows=200, back=False):
    """Loading to 1 mm, with noise of 0.02 N on 20 N."""
    x = np.linspace(0.0, 1.0, rows)
    x = np.r_[x, x[-2::-1]] if back else x
    return x, STIFFNESS * x + RNG.normal(0.0, 0.02, x.size)


def only(found):
    (one,) = found.observations
    return one


def slope(found):
    kept = found.kept
    return np.polyfit(found.deformation[kept], found.force[kept], 1)[0]


def test_rows_before_the_tare_are_cut():
    x, y = ramp()
    x, y = np.r_[0.0, 0.0, 0.0, x], np.r_[12.0, 12.01, 11.99, y]
    found = screen(x, y)
    one = only(found)
    assert (one.kind, one.rows, one.action) == ("before the tare", ((0, 2),), "cut")
    assert one.size == pytest.approx(-12.0, abs=0.1)
    assert found.kept.sum() == x.size - 3


@pytest.mark.parametrize("size", [-8.0, 1.5, 30.0])
@pytest.mark.parametrize("back", [False, True])
def test_a_jump_of_the_force_is_a_new_zero(size, back):
    x, y = ramp(back=back)
    y[90:] += size
    found = screen(x, y)
    one = only(found)
    assert (one.kind, one.rows) == ("jump of the force", ((90, 90),))
    assert one.size == pytest.approx(size, abs=0.1)
    assert slope(found) == pytest.approx(STIFFNESS, rel=0.01)
    np.testing.assert_array_equal(found.zero, np.arange(x.size) >= 90)


@pytest.mark.parametrize("size", [-0.7, 0.1, 5.0])
def test_a_jump_of_the_deformation_is_a_new_zero(size):
    x, y = ramp(back=True)
    x[120:] += size
    one = only(found := screen(x, y))
    assert (one.kind, one.rows, one.unit) == (
        "jump of the deformation",
        ((120, 120),),
        "mm",
    )
    assert one.size == pytest.approx(size, abs=0.01)
    assert slope(found) == pytest.approx(STIFFNESS, rel=0.01)


def test_a_jump_by_more_than_all_movements_is_found_at_a_turn_and_without_contact():
    way = 1.0 - np.abs(np.linspace(0.0, 4.0, 401) % 2.0 - 1.0)
    noise = np.random.default_rng(5).normal(0.0, 0.02, 401)
    force = STIFFNESS * np.maximum(way - 0.3, 0.0) + noise
    x = way + 3.0 * (np.arange(401) >= 200)
    one = only(found := screen(x, force))
    assert (one.kind, one.rows) == ("jump of the deformation", ((200, 200),))
    assert one.size == pytest.approx(3.0, abs=0.03)
    assert found.straight.slope == pytest.approx(STIFFNESS, rel=0.01)


@pytest.mark.parametrize("rows", [12, 20, 60])
def test_noise_about_one_level_has_no_jump(rows):
    rng = np.random.default_rng(rows)
    x = np.linspace(0.0, 1.0, rows)
    kinds = {
        one.kind
        for _ in range(80)
        for one in screen(x, rng.normal(0.0, 1.0, rows)).observations
    }
    assert not [kind for kind in kinds if "jump" in kind]


def test_the_knee_of_a_preload_is_no_jump():
    """An extension spring with slack, whose coils open at 30 N within two rows."""
    x = np.arange(120) / 3.0
    y = np.interp(x, [0.0, 1.2, 1.7, 40.0], [0.0, 0.0, 30.0, 30.0 + 2.1 * 38.3])
    found = screen(x, y + RNG.normal(0.0, 0.03, x.size))
    assert not found.observations
    assert found.straight.slope == pytest.approx(2.1, rel=0.01)


def contact_cycles(seed=0, friction=0.0, play=0.0):
    """Three cycles of 50 N/mm to 10 mm with contact from 3 mm on, 600 rows.

    Friction turns, and play is taken up, within one row after a turn.
    """
    rng = np.random.default_rng(seed)
    x = 10.0 * (1.0 - np.abs(np.linspace(0.0, 6.0, 600) % 2.0 - 1.0))
    way = np.sign(np.gradient(x))
    force = 50.0 * np.maximum(x - 3.0, 0.0) + friction * way * (x > 3.0)
    x = x + 0.5 * play * way + rng.normal(0.0, 0.003, 600)
    return x, force + rng.normal(0.0, 0.2, 600)


@pytest.mark.parametrize("size", [2.0, -2.0])
@pytest.mark.parametrize("row", [200, 297, 300, 303, 340, 400])
def test_a_jump_between_cycles_is_found_at_a_turn_and_before_contact(row, size):
    x, force = contact_cycles()
    x[row:] += size
    one = only(found := screen(x, force))
    assert (one.kind, one.rows) == ("jump of the deformation", ((row, row),))
    assert one.size == pytest.approx(size, abs=0.15)
    assert found.straight.slope == pytest.approx(50.0, rel=0.003)


@pytest.mark.parametrize("play", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("friction", [0.0, 5.0, 30.0])
def test_friction_and_play_within_one_row_are_no_jumps(friction, play):
    found = screen(*contact_cycles(friction=friction, play=play))
    assert not [one for one in found.observations if "jump" in one.kind]


def test_several_wild_readings_do_not_hide_each_other():
    x, y = ramp()
    wild = [40, 41, 42, 52, 100, 150, 151]
    y[wild] += [60.0, 55.0, 58.0, 61.0, -30.0, 4.0, 4.0]
    one = only(screen(x, y))
    assert one.kind == "wild reading"
    assert one.rows == ((40, 42), (52, 52), (100, 100), (150, 151))


def test_the_record_ends_where_the_part_breaks():
    x, y = ramp()
    y[140:] = np.linspace(4.0, 3.0, 60)
    found = screen(x, y)
    one = only(found)
    assert (one.kind, one.rows) == ("after the largest force", ((140, 199),))
    assert one.size == pytest.approx(10.4, abs=0.6)
    assert SEGMENTS[found.segment[150]] == "after the largest force"


def test_a_negative_slope_in_places_is_asked_about():
    x = np.linspace(0.0, 1.0, 100)
    one = only(screen(x, -STIFFNESS * x + 12.0 * np.sin(25.0 * x)))
    assert (one.kind, one.action) == ("negative slope", "asked")


def test_a_saturated_force_is_cut():
    x, y = ramp(back=True)
    y = np.round(np.minimum(y, 15.0), 3)
    found = screen(x, y)
    one = only(found)
    assert (one.kind, one.size) == ("saturation of the force", 15.0)
    assert one.count == pytest.approx(100, abs=4)
    assert slope(found) == pytest.approx(STIFFNESS, rel=0.01)


@pytest.mark.parametrize("sd", [0.02, 0.1])
def test_scatter_of_the_deformation_is_measured(sd):
    x, y = ramp(400, back=True)
    found = screen(x + RNG.normal(0.0, sd, x.size), y)
    one = only(found)
    assert (one.kind, one.action) == ("scatter of the deformation", "smoothed")
    assert found.deformation_sd == pytest.approx(sd, rel=0.15)
    assert found.trembling == (sd > 0.05)
    assert found.straight.slope == pytest.approx(STIFFNESS, rel=0.06)


@pytest.mark.parametrize(
    ("curve", "low", "high"),
    [
        (lambda x: 20.0 * np.maximum(x - 0.3, 0.0), 0.3, 1.0),
        (
            lambda x: 20.0 * np.minimum(x, 0.6) + 0.8 * np.maximum(x - 0.6, 0.0),
            0.0,
            0.6,
        ),
        (lambda x: np.where(x < 0.02, 400.0 * x, 8.0 + 20.0 * (x - 0.02)), 0.02, 1.0),
    ],
    ids=["approach", "yield", "preload"],
)
def test_the_longest_straight_part(curve, low, high):
    x = np.linspace(0.0, 1.0, 300)
    part = screen(x, curve(x) + RNG.normal(0.0, 0.02, 300)).straight
    assert not part.whole
    # A tenth of it is left out where it meets another piece.
    margin = 0.1 * (high - low)
    low, high = low + margin * (low > 0.0), high - margin * (high < 1.0)
    assert part.low == pytest.approx(low, abs=0.02)
    assert part.high == pytest.approx(high, abs=0.02)
    assert part.slope == pytest.approx(20.0, rel=0.01)


@pytest.mark.parametrize("seed", range(2))
def test_behind_a_gauge_that_trembles_faults_and_pieces_are_found(seed):
    """The scatter is 8 % of the stroke, the jump 20 % of the force."""
    rng = np.random.default_rng(seed)
    x, rows = np.linspace(0.0, 1.0, 1000), np.arange(1000)
    read = x + rng.normal(0.0, 0.08, 1000)
    noise = rng.normal(0.0, 0.02, 1000)
    found = screen(read, STIFFNESS * x + noise + 4.0 * (rows >= 600))
    kinds = {one.kind: one for one in found.observations}
    assert {*kinds} == {"jump of the force", "scatter of the deformation"}
    assert kinds["jump of the force"].rows == ((600, 600),)
    part = screen(read, STIFFNESS * np.maximum(x - 0.4, 0.0) + noise).straight
    assert not part.whole
    assert part.slope == pytest.approx(STIFFNESS, abs=3.0 * part.slope_sd)
    assert part.slope_sd < 0.06 * STIFFNESS


def test_runs_are_screened_by_themselves():
    x, y = ramp(50)
    wild = y.copy()
    wild[20] += 50.0
    found = screen(np.tile(x, 3), np.r_[y, wild, y], run=np.repeat([0, 1, 2], 50))
    one = only(found)
    assert (one.run, one.rows) == (1, ((70, 70),))


def test_a_part_that_gives_way_after_cycles_ends_the_record():
    x = 1.0 - np.abs(np.linspace(0.0, 5.0, 500) % 2.0 - 1.0)
    y = STIFFNESS * x + RNG.normal(0.0, 0.02, 500)
    y[470:] = 3.0
    one = only(screen(x, y))
    assert (one.kind, one.rows) == ("after the largest force", ((470, 499),))


def test_a_logger_that_is_faster_than_its_gauges_repeats_readings():
    x, y = ramp(40)
    found = screen(np.repeat(x, 7), np.repeat(y, 7))
    (one,) = found.observations
    assert (one.kind, one.count, one.size) == ("repeated reading", 240, 7.0)
    assert np.array_equal(found.deformation[found.kept], x)
    # A hold at a few places is no such logger.
    held = np.r_[np.arange(40), np.full(60, 39)]
    assert not screen(x[held], y[held]).observations


@pytest.mark.parametrize("rows", [5, 12, 50])
@pytest.mark.parametrize("seed", range(2))
def test_ramps_of_one_zero_that_begin_anew_have_no_jump(rows, seed):
    rng = np.random.default_rng(seed)
    x = np.tile(np.linspace(0.1, 1.0, rows), 4) + rng.normal(0.0, 1e-3, 4 * rows)
    found = screen(x, 100.0 * x + rng.normal(0.0, 0.2, x.size))
    assert not [one for one in found.observations if "jump" in one.kind]


def test_a_gauge_zeroed_at_rest_begins_the_record():
    x, y = ramp()
    x, y = np.r_[np.full(30, -3.0), x], np.r_[np.zeros(30), y]
    one = only(screen(x, y))
    assert (one.kind, one.rows) == ("before the tare", ((0, 29),))


def test_an_uneven_movement_is_no_scatter():
    x = np.cumsum(np.abs(RNG.normal(0.0, 1.0, 400))) * 0.01
    x = x + RNG.normal(0.0, 0.05, 400)
    assert screen(x, STIFFNESS * x + RNG.normal(0.0, 0.02, 400)).observations == ()


def test_few_rows_show_a_gauge_that_trembles_much():
    found = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        x = np.linspace(0.0, 1.0, 60)
        y = STIFFNESS * x + rng.normal(0.0, 0.02, 60)
        found += screen(x + rng.normal(0.0, 0.1, 60), y).deformation_sd > 0.0
    assert found >= 18


def test_computed_cycles_without_any_error_share_a_part():
    """Multiples of 1/64 leave not even rounding."""
    way = 1.0 - np.abs(np.arange(385) / 64.0 % 2.0 - 1.0)
    part = screen(way, STIFFNESS * np.maximum(way - 0.25, 0.0)).straight
    assert part.slope == pytest.approx(STIFFNESS, rel=1e-9) and not part.whole


def test_rows_of_a_file_are_named_with_the_file_once():
    found = Observation("wild reading", ((1, 3), (4, 4)), 2.0, "N", "cut")
    plain, of_file = np.arange(2, 8), np.array([f"{k} of a b" for k in range(2, 8)])
    assert in_words(found, plain, "all", FORCE).where == "rows 3-5, 6"
    assert in_words(found, of_file, "all", FORCE).where == "rows 3-5 of a b, 6 of a b"
