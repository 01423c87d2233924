"""From a CSV file to the stiffness of the gear and its uncertainty."""

from pathlib import Path

import hdcal

FOLDER = Path(__file__).parents[1] / "datasets" / "xb1-100-80"


def main() -> None:
    case = hdcal.read_case(FOLDER / "data.csv", FOLDER / "gear.toml")
    # Half the default length: enough for the checks, quicker for an example.
    posterior = hdcal.calibrate(case, warmup=500, draws=500, seed=1)
    summary = hdcal.summarise(posterior)

    print(f"status: {summary['status']}")
    k = summary["stiffness_N_per_mm"]
    print(f"stiffness: {k['median']:.0f} N/mm [{k['lo']:.0f}, {k['hi']:.0f}]")
    for name, found in summary["parameters"].items():
        print(
            f"{name:20} {found['median']:10.4g} {found['unit']:4}"
            f" driven by {found['driven_by']}"
        )
    for sentence in summary["warnings"] + summary["flat_directions"]:
        print("-", sentence)

    # Ordinary least squares with an intercept gives 209.4 N/mm.
    assert k["lo"] < 209.4 < k["hi"]
    print("the least-squares slope lies inside the interval")


if __name__ == "__main__":
    main()
