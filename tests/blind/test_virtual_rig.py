"""The virtual rig shows each mechanism at the size that was asked for."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hdcal.blind.virtual_rig.loadings import LOADINGS, loading_of
from hdcal.blind.virtual_rig.mechanism import RigState
from hdcal.blind.virtual_rig.paths import guide, sliding_cells, solid, wedge
from hdcal.blind.virtual_rig.sensing import NOISES, charge_amplifier
from hdcal.blind.virtual_rig.virtual_rig import (
    MECHANISMS,
    ActiveMechanism,
    VirtualRig,
    draw_noise,
    draw_rig,
)
from hdcal.data.reading import read_case

RICH, FLEET = LOADINGS["rich"](), LOADINGS["fleet"]()
GEAR = """\
[gear]
wall_thickness_mm = 0.68
radius_mm = 40.0
length_mm = 70.0
material = "40CrNiMoA"
"""


def rig_for(name: str) -> VirtualRig:
    needs = MECHANISMS[name].needs
    return VirtualRig((FLEET if needs - RICH.features else RICH).history)


def state_of(rig: VirtualRig) -> RigState:
    stiffness = np.full(len(rig.history.run), rig.stiffness)
    return RigState(rig.history, stiffness, rig.history.deformation)


@pytest.mark.parametrize("name", MECHANISMS)
def test_a_mechanism_is_as_visible_as_asked(name):
    rig, rng = rig_for(name), np.random.default_rng(2)
    for r in (0.15, 0.3):
        made = rig.draw_mechanism(name, r, rng)
        assert made is not None
        assert rig.gap_over_noise(rig.curve(made)) == pytest.approx(r, rel=1e-3)
        assert abs(made.size) < MECHANISMS[name].largest


@pytest.mark.parametrize("name", MECHANISMS)
def test_without_size_a_mechanism_adds_nothing(name):
    rig, shape = rig_for(name), MECHANISMS[name].draw(np.random.default_rng(4))
    curve = rig.curve(ActiveMechanism(name, 1e-10, shape))
    assert np.max(np.abs(curve)) < 1e-5
    assert rig.draw_mechanism(name, 1e4, np.random.default_rng(0)) is None


def test_a_rig_on_which_nothing_is_wrong_is_a_straight_line():
    rig = VirtualRig(RICH.history, alpha=3.4e-4, zero=1.2, shift=0.003)
    assert rig.gap_over_noise(rig.fault_free) < 1.0
    # It is the spread of the modulus' loss that the calibration has to infer.
    nominal = VirtualRig(RICH.history)
    cold = nominal.history.temperature == 20.0
    slope = np.polyfit(nominal.history.deformation[cold], nominal.fault_free[cold], 1)
    np.testing.assert_allclose(slope, [200.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("name", LOADINGS)
def test_a_reader_finds_the_features_of_a_loading(name, tmp_path):
    loading = LOADINGS[name]()
    force = VirtualRig(loading.history).fault_free
    (tmp_path / "a.csv").write_text(loading.csv(force))
    (tmp_path / "gear.toml").write_text(GEAR)
    case = read_case(tmp_path / "a.csv", tmp_path / "gear.toml")
    records = case.records
    assert records.known - {"force_sd"} == loading.features
    np.testing.assert_allclose(records.force, force, atol=1e-4)
    np.testing.assert_array_equal(records.direction, loading.history.direction)
    again = loading_of(case).history
    np.testing.assert_allclose(
        again.deformation, loading.history.deformation, atol=1e-5
    )
    np.testing.assert_array_equal(again.run, loading.history.run)
    np.testing.assert_array_equal(again.sense, loading.history.sense)


def test_the_charge_amplifier_obeys_its_circuit():
    """Two capacitors that leak: the rows' recursion against an integrator."""
    rig = VirtualRig(LOADINGS["lean"]().history)
    state, time = state_of(rig), rig.history.time
    force, slow, rate = rig.fault_free, 0.2, 4e-3
    read = force + charge_amplifier(force, state, rate, {"slow": slow})
    rates = rate / (1.0 - 0.8 * slow) * np.array([1.0, 0.2])
    rise = np.diff(force) / np.diff(time)

    def flow(at, charge):
        row = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(rise) - 1)
        return np.array([1.0 - slow, slow]) * rise[row] - rates * charge

    start = np.array([1.0 - slow, slow]) * force[0]
    found = solve_ivp(flow, time[[0, -1]], start, t_eval=time, max_step=0.5, rtol=1e-8)
    np.testing.assert_allclose(read, found.y.sum(axis=0), rtol=2e-3, atol=2e-3)


def test_a_held_solid_relaxes_to_its_long_term_force():
    rig = VirtualRig(LOADINGS["holds"]().history)
    lost = solid(
        rig.fault_free, state_of(rig), 0.1, {"tau": 1.0, "share": np.ones(3) / 3}
    )
    top = np.flatnonzero(rig.history.deformation == np.max(rig.history.deformation))
    held = top[rig.history.direction[top] == 0.0]
    np.testing.assert_allclose(lost[held], -0.1 * rig.fault_free[held], rtol=1e-6)


@pytest.mark.parametrize(
    ("friction", "shape", "pressed"),
    [
        (guide, {"reach": 0.004}, False),
        (wedge, {"reach": 0.004}, True),
        (
            sliding_cells,
            {"reach": np.linspace(0.02, 0.2, 5), "share": np.ones(5) / 5},
            False,
        ),
    ],
)
def test_friction_takes_work_from_every_loop(friction, shape, pressed):
    rig = VirtualRig(LOADINGS["rates"]().history)
    force = friction(rig.fault_free, state_of(rig), 2.0, shape)
    step = np.diff(rig.history.deformation, prepend=0.0)
    for loop in range(6):
        inside = rig.history.cycle == loop
        assert np.sum((force * step)[inside]) > 0.0
    most = 2.0 * (np.abs(rig.fault_free) if pressed else 1.0)
    assert np.all(np.abs(force) <= most + 1e-12)


def test_noise_has_its_sd_and_its_correlation():
    rig = VirtualRig(RICH.history, sigma=0.7)
    rng = np.random.default_rng(8)
    noise = np.array([draw_noise(rig, rng, 0.4) for _ in range(400)])
    assert np.std(noise) == pytest.approx(0.7, rel=0.02)
    inside = ~rig.history.run_starts[1:]
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
        "assert found <= {'blind', 'data', 'errors', 'notebook', 'programs'}, found"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_rigs_differ():
    rng = np.random.default_rng(0)
    drawn = [draw_rig(RICH.history, rng).stiffness for _ in range(5)]
    assert len(set(drawn)) == 5
