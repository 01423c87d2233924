"""From six gears to an actuator: bounds for gears that were not measured."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import stats

import hdcal

GEAR = Path(__file__).parents[1] / "datasets" / "xb1-100-80" / "gear.toml"
AT, STIFFNESS, SPREAD, NOISE, GEARS = 0.4, 205.0, 0.03, 0.4, 6


def measure(folder: Path) -> hdcal.Case:
    """Return simulated readings of six gears of known stiffness, eight each."""
    rng = np.random.default_rng(8)
    rows = ["deformation_mm,force_N,specimen"]
    for gear in range(GEARS):
        stiffness = STIFFNESS * (1.0 + SPREAD * rng.normal())
        for deformation in np.linspace(0.05, 0.54, 8):
            force = stiffness * deformation + NOISE * rng.normal()
            rows.append(f"{deformation:.4f},{force:.4f},{gear}")
    (folder / "data.csv").write_text("\n".join(rows) + "\n")
    case = hdcal.read_case(folder / "data.csv", GEAR)
    # These readings are not rounded.
    return replace(case, gear=replace(case.gear, force_resolution=0.0))


def main() -> None:
    with tempfile.TemporaryDirectory() as place:
        case = measure(Path(place))
    posterior = hdcal.calibrate(case, warmup=500, draws=500)
    found = hdcal.margin(posterior, AT, content=0.99, limit_force=100.0)
    level = found.worst
    print(found.headline)
    print(f"99/95 bounds: {level.lower_bound_N:.1f} … {level.upper_bound_N:.1f} N")
    print(f"more than 100 N: {level.exceedance.probability:.1e}")

    # The textbook bound from the six slopes alone, and what is true of the batch.
    records = case.records
    slopes = [
        float(np.polyfit(records.deformation[rows], records.force[rows], 1)[0])
        for rows in (records.specimen == gear for gear in range(GEARS))
    ]
    root, quantile = np.sqrt(GEARS), stats.norm.ppf(0.99)
    k = stats.nct.ppf(0.95, GEARS - 1, quantile * root) / root
    spread = k * np.std(slopes, ddof=1)
    print(f"textbook, mean + k s: {AT * (np.mean(slopes) + spread):.1f} N")
    true = AT * STIFFNESS * (1.0 + 2.326 * SPREAD)
    print(f"true for 99 % of the gears: {true:.1f} N")
    assert true < level.upper_bound_N
    print("the bound holds for the gears that were not measured")


if __name__ == "__main__":
    main()
