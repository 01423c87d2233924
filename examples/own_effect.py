"""A new effect, added from outside and recovered from synthetic data."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import hdcal


class QuadraticGauge(
    hdcal.Effect, stage="deformation", groups=("curve up",), symmetry="even"
):
    """A displacement gauge that is not quite linear: ω → ω + e ω²."""

    error: float = hdcal.parameter(
        "1/mm", "relative error of the gauge per mm", typical=0.02, null=0.0
    )

    def apply(self, signal, rows):
        return signal + self.error * signal**2


LIBRARY = hdcal.EFFECTS | {QuadraticGauge.name: QuadraticGauge}

GEAR = """
[gear]
wall_thickness_mm = 0.68
radius_mm = 40.0
length_mm = 70.0

[priors.quadratic_gauge]
error = { family = "normal", mean = 0.0, sd = 0.1, unit = "1/mm" }
"""
TRUE_ERROR = 0.08


def write_case(folder: Path) -> None:
    """Write synthetic readings: 200 N/mm, a curved gauge, 0.1 N of noise."""
    read = np.linspace(0.02, 0.6, 30)
    true = read + TRUE_ERROR * read**2
    force = 200.0 * true + np.random.default_rng(3).normal(0.0, 0.1, len(read))
    lines = [f"{x:.3f},{f:.3f}" for x, f in zip(read, force, strict=True)]
    table = "\n".join(["deformation_mm,force_N", *lines])
    (folder / "data.csv").write_text(table + "\n", encoding="utf-8")
    (folder / "gear.toml").write_text(GEAR, encoding="utf-8")


def main() -> None:
    with TemporaryDirectory() as name:
        folder = Path(name)
        write_case(folder)
        posterior = hdcal.calibrate(
            hdcal.read_case(folder),
            effects=["quadratic_gauge"],
            registry=LIBRARY,
            warmup=500,
            draws=500,
        )
        posterior.save(folder / "posterior.nc")
        again = hdcal.Posterior.load(folder / "posterior.nc", effects=LIBRARY)

    found = hdcal.summarise(again)["parameters"]["quadratic_gauge.error"]
    print(f"true error of the gauge: {TRUE_ERROR} per mm")
    print(f"found: {found['median']:.3f} [{found['lo']:.3f}, {found['hi']:.3f}]")
    assert again.usable
    assert found["lo"] < TRUE_ERROR < found["hi"]
    print("the truth lies inside the interval")


if __name__ == "__main__":
    main()
