"""Mechanisms that depend on temperature, none of them quite linear in it."""

from benchmarks.blind.rig.virtual_rig import Mechanism, RigState, Shape


def bent_line(signal, state: RigState, size: float, shape: Shape):
    """Growth with temperature, not quite linear; size: mean slope to 30 K above."""
    rise = state.history.rise
    return size * rise * (1.0 + shape["bend"] * (rise - 30.0))


def softening(force, state: RigState, size: float, shape: Shape):
    """Seat and pads lose stiffness with temperature besides the steel; size [1/K]."""
    rise = state.history.rise
    return force * size * rise * (1.0 + shape["bend"] * rise)


def _bend(rng) -> Shape:
    return {"bend": rng.uniform(-0.006, 0.006)}


_NEEDS = frozenset({"temperature"})

TEMPERATURE: dict[str, Mechanism] = {
    # The frame grows [mm/K].
    "thermal_expansion": Mechanism(
        "table",
        bent_line,
        0.004,
        _NEEDS,
        draw=_bend,
        signed=True,
    ),
    "thermal_stiffness": Mechanism(
        "gear", softening, 0.0015, _NEEDS, draw=_bend, signed=True
    ),
    # The zero of the bridge drifts [N/K].
    "thermal_zero_drift": Mechanism(
        "reading",
        bent_line,
        0.6,
        _NEEDS,
        draw=_bend,
        signed=True,
    ),
}
