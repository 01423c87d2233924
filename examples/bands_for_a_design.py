"""Force at the design deformation, cold and warm, with bands."""

from pathlib import Path

import numpy as np

import hdcal

FOLDER = Path(__file__).parents[1] / "datasets" / "thermal-demo"
DEFORMATION, TEMPERATURES = 0.4, [20.0, 80.0]  # mm, °C


def main() -> None:
    case = hdcal.read_case(FOLDER)
    posterior = hdcal.calibrate(
        case, effects=["thermal_zero_drift"], warmup=500, draws=500
    )
    bands = hdcal.predict(posterior, [DEFORMATION], TEMPERATURES)
    print(f"what the rig would read at {DEFORMATION} mm, 95 % bands:")
    for row, warm in enumerate(bands.temperature_C):
        print(
            f"  {warm:.0f} °C: {bands.physics_median_N[row]:.1f} N,"
            f" mean [{bands.physics_lo_N[row]:.1f}, {bands.physics_hi_N[row]:.1f}],"
            f" one reading [{bands.new_measurement_lo_N[row]:.1f},"
            f" {bands.new_measurement_hi_N[row]:.1f}],"
            f" within the data: {bands.tested[row]}"
        )

    # The gear itself has no zero error and no drift: stiffness times deformation.
    draws, reference = posterior.draws, case.gear.reference_temperature
    print("what the gear itself takes:")
    for warm in TEMPERATURES:
        softening = 1.0 - draws["alpha"] * (warm - reference)
        force = draws["stiffness"] * softening * DEFORMATION
        low, middle, high = np.quantile(force, [0.025, 0.5, 0.975])
        print(f"  {warm:.0f} °C: {middle:.2f} N [{low:.2f}, {high:.2f}]")
        # The data were made with these values, see the data set's README.
        modulus, influence, loss = 206e3, 2.5, 3.2e-4
        truth = hdcal.force(
            case.gear.geometry,
            modulus,
            influence,
            DEFORMATION,
            alpha=loss,
            temperature_rise=warm - reference,
        )
        assert low < truth < high, (warm, low, float(truth), high)
    print("the true forces lie inside the bands")


if __name__ == "__main__":
    main()
