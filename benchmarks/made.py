"""Made-up measurements of any length, on the gear of the XB1-100-80 case."""

from pathlib import Path

import numpy as np

SLOPE, NOISE, STEP = 209.0, 1.5, 0.98


def rows(size: int) -> dict[str, np.ndarray]:
    """Return one ramp, read on the scale of the case, warming up by two kelvins."""
    noise = np.random.default_rng(size).normal(0.0, NOISE, size)
    deformation = np.linspace(0.02, 0.54, size)
    force = STEP * np.round((SLOPE * deformation + noise) / STEP)
    time = np.arange(size) * 0.01
    return {
        "time_s": time,
        "temperature_C": 20.0 + 2.0 * time / max(time[-1], 1.0),
        "deformation_mm": deformation,
        "force_N": force,
    }


def write_csv(path: Path, size: int, names: tuple[str, ...]) -> None:
    """Write some of the columns with six decimals."""
    table = rows(size)
    np.savetxt(
        path,
        np.column_stack([table[name] for name in names]),
        fmt="%.6f",
        delimiter=",",
        header=",".join(names),
        comments="",
    )


def columns(text: str) -> tuple[str, ...]:
    return tuple(text.split(","))


if __name__ == "__main__":
    import sys

    write_csv(Path(sys.argv[1]), int(sys.argv[2]), columns(sys.argv[3]))
