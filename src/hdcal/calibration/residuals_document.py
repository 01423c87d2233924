"""What a calibration leaves over, in words and as a table."""

import numpy as np

from hdcal.inference.residuals import Residuals
from hdcal.report.document import Document, Section, Sentences

_NOISE = "No shape was found in the residuals that pure noise would rarely show."


def residuals_document(left: Residuals) -> Document:
    """Return the report of residuals."""
    found = [one.words for one in (*left.structure, *left.noise)]
    size = float(np.sqrt(np.mean(left.residual**2)))
    about = f"measured − fitted in {len(left.residual)} rows, {size:.3g} N (rms)"
    more = [Section("What else", [Sentences(found[1:])], brief=True)]
    return Document(
        name="Residuals",
        kind="residuals",
        subtitle=about,
        headline=found[0] if found else _NOISE,
        sections=more if found[1:] else [],
    )


def residual_columns(left: Residuals) -> dict[str, np.ndarray]:
    """Return the rows by column."""
    return {
        "deformation_mm": left.deformation,
        "temperature_C": left.temperature,
        "direction": left.direction,
        "run": left.run,
        "measured_N": left.measured,
        "fitted_N": left.fitted,
        "residual_N": left.residual,
        "standardised": left.standardised,
    }
