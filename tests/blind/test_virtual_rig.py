"""The virtual rig shows each mechanism at the size that was asked for."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hdcal.blind.virtual_rig.loadings import PROGRAMS, program_of
from hdcal.blind.virtual_rig.mechanism import Rig
from hdcal.blind.virtual_rig.paths import guide, sliding_cells, solid
from hdcal.blind.virtual_rig.sensing import NOISES, charge_amplifier
from hdcal.blind.virtual_rig.virtual_rig import (
    MECHANISMS,
    Bench,
    Switched,
    draw_bench,
    draw_noise,
)
from hdcal.data.reading import read_case

RICH, FLEET = PROGRAMS["rich"](), PROGRAMS["fleet"]()
GEAR = """\
[gear]
wall_thickness_mm = 0.68
radius_mm = 40.0
length_mm = 70.0
material = "40CrNiMoA"
"""


def bench_for(name: str) -> Bench:
    needs = MECHANISMS[name].needs
    return Bench((FLEET if needs - RICH.features else RICH).history)


def rig_of(bench: Bench) -> Rig:
    stiffness = np.full(len(bench.history.run), bench.stiffness)
    return Rig(bench.history, stiffness, bench.history.deformation)


@pytest.mark.parametrize("name", MECHANISMS)
def test_a_mechanism_is_as_visible_as_asked(name):
    bench, rng = bench_for(name), np.random.default_rng(2)
    for r in (0.15, 0.3):
        made = bench.at_size(name, r, rng)
        assert made is not None
        assert bench.visible(bench.curve(made)) == pytest.approx(r, rel=1e-3)
        assert abs(made.size) < MECHANISMS[name].largest


@pytest.mark.parametrize("name", MECHANISMS)
def test_without_size_a_mechanism_adds_nothing(name):
    bench, shape = bench_for(name), MECHANISMS[name].draw(np.random.default_rng(4))
    curve = bench.curve(Switched(name, 1e-10, shape))
    assert np.max(np.abs(curve)) < 1e-5
    assert bench.at_size(name, 1e4, np.random.default_rng(0)) is None


def test_a_rig_on_which_nothing_is_wrong_is_a_straight_line():
    bench = Bench(RICH.history, alpha=3.4e-4, zero=1.2, shift=0.003)
    assert bench.visible(bench.plain) < 1.0
    # It is the spread of the modulus' loss that the calibration has to infer.
    nominal = Bench(RICH.history)
    cold = nominal.history.temperature == 20.0
    slope = np.polyfit(nominal.history.deformation[cold], nominal.plain[cold], 1)
    np.testing.assert_allclose(slope, [200.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_reader_finds_the_features_of_a_program(name, tmp_path):
    program = PROGRAMS[name]()
    force = Bench(program.history).plain
    (tmp_path / "a.csv").write_text(program.csv(force))
    (tmp_path / "gear.toml").write_text(GEAR)
    case = read_case(tmp_path / "a.csv", tmp_path / "gear.toml")
    told = case.records
    assert told.known - {"force_sd"} == program.features
    np.testing.assert_allclose(told.force, force, atol=1e-4)
    np.testing.assert_array_equal(told.direction, program.history.direction)
    again = program_of(case).history
    np.testing.assert_allclose(
        again.deformation, program.history.deformation, atol=1e-5
    )
    np.testing.assert_array_equal(again.run, program.history.run)
    np.testing.assert_array_equal(again.sense, program.history.sense)


def test_the_charge_amplifier_obeys_its_circuit():
    """Two capacitors that leak: the rows' recursion against an integrator."""
    bench = Bench(PROGRAMS["lean"]().history)
    rig, time = rig_of(bench), bench.history.time
    force, slow, rate = bench.plain, 0.2, 4e-3
    read = force + charge_amplifier(force, rig, rate, {"slow": slow})
    rates = rate / (1.0 - 0.8 * slow) * np.array([1.0, 0.2])
    rise = np.diff(force) / np.diff(time)

    def flow(at, charge):
        row = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(rise) - 1)
        return np.array([1.0 - slow, slow]) * rise[row] - rates * charge

    start = np.array([1.0 - slow, slow]) * force[0]
    found = solve_ivp(flow, time[[0, -1]], start, t_eval=time, max_step=0.5, rtol=1e-8)
    np.testing.assert_allclose(read, found.y.sum(axis=0), rtol=2e-3, atol=2e-3)


def test_a_held_solid_relaxes_to_its_long_term_force():
    bench = Bench(PROGRAMS["holds"]().history)
    lost = solid(bench.plain, rig_of(bench), 0.1, {"tau": 1.0, "share": np.ones(3) / 3})
    top = np.flatnonzero(bench.history.deformation == np.max(bench.history.deformation))
    held = top[bench.history.direction[top] == 0.0]
    np.testing.assert_allclose(lost[held], -0.1 * bench.plain[held], rtol=1e-6)


@pytest.mark.parametrize(
    ("friction", "shape"),
    [
        (guide, {"reach": 0.004}),
        (sliding_cells, {"reach": np.linspace(0.02, 0.2, 5), "share": np.ones(5) / 5}),
    ],
)
def test_friction_takes_work_from_every_loop(friction, shape):
    bench = Bench(PROGRAMS["rates"]().history)
    force = friction(bench.plain, rig_of(bench), 2.0, shape)
    step = np.diff(bench.history.deformation, prepend=0.0)
    for loop in range(6):
        inside = bench.history.cycle == loop
        assert np.sum((force * step)[inside]) > 0.0
    assert np.max(np.abs(force)) <= 2.0 + 1e-12


def test_noise_has_its_sd_and_its_correlation():
    bench = Bench(RICH.history, sigma=0.7)
    rng = np.random.default_rng(8)
    noise = np.array([draw_noise(bench, rng, 0.4) for _ in range(400)])
    assert np.std(noise) == pytest.approx(0.7, rel=0.02)
    inside = ~bench.history.run_starts[1:]
    pairs = (noise[:, 1:] * noise[:, :-1]).mean(axis=0) / 0.49
    assert np.mean(pairs[inside]) == pytest.approx(0.4, abs=0.02)
    assert np.mean(pairs[~inside]) == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("name", NOISES)
def test_noise_mechanisms_have_the_size_asked_for(name):
    rng = np.random.default_rng(1)
    force = 200.0 * np.linspace(0.02, 0.54, 400)
    added = [NOISES[name](force, 0.8, rng) for _ in range(50)]
    assert np.sqrt(np.mean(np.square(added))) == pytest.approx(0.8, rel=0.05)


def test_the_rig_knows_nothing_of_the_library():
    code = (
        "import sys, hdcal.blind.virtual_rig.mixes\n"
        "found = {m.split('.')[1] for m in sys.modules if m.startswith('hdcal.')}\n"
        "assert found <= {'blind', 'data', 'errors'}, found"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_rigs_differ():
    rng = np.random.default_rng(0)
    drawn = [draw_bench(RICH.history, rng).stiffness for _ in range(5)]
    assert len(set(drawn)) == 5
