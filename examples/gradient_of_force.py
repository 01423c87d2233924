"""Derivatives of the force by every size of the gear."""

import jax

import hdcal

GEAR = hdcal.Geometry(
    wall_thickness=0.68, radius=40.0, length=70.0, load_height=62.0, poisson=0.29
)
MODULUS, INFLUENCE, DEFORMATION = 207e3, 2.6, 0.4  # MPa, -, mm
# Half-widths of workshop tolerances [mm].
TOLERANCES = {"wall_thickness": 0.02, "radius": 0.05, "length": 0.1}


def force_of(geometry: hdcal.Geometry) -> jax.Array:
    """Return the force at the design deformation [N]."""
    return hdcal.force(geometry, MODULUS, INFLUENCE, DEFORMATION, theory="ring")


def by_difference(name: str) -> float:
    """Return the same derivative from two nearby gears [N/mm]."""
    size = getattr(GEAR, name)
    step = 1e-5 * size

    def at(value: float) -> float:
        sizes = {**vars(GEAR), name: value}
        return float(force_of(hdcal.Geometry(**sizes)))

    return (at(size + step) - at(size - step)) / (2.0 * step)


def main() -> None:
    force, slope = jax.jit(jax.value_and_grad(force_of))(GEAR)
    print(f"force at {DEFORMATION} mm: {force:.2f} N")
    swings = {
        name: float(getattr(slope, name)) * width for name, width in TOLERANCES.items()
    }
    for name, swing in sorted(swings.items(), key=lambda item: -abs(item[1])):
        print(f"{name:15} ± {TOLERANCES[name]} mm changes it by {swing:+7.3f} N")

    for name in TOLERANCES:
        exact, near = float(getattr(slope, name)), by_difference(name)
        assert abs(near / exact - 1.0) < 1e-7, (name, exact, near)
    print("the derivatives agree with finite differences")


if __name__ == "__main__":
    main()
