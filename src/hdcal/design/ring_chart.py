"""Chart of a ring that two opposed loads deform: shape, moment and stress."""

import numpy as np

from hdcal.data.records import Geometry
from hdcal.exported import jit
from hdcal.physics.profile import ring_profile
from hdcal.physics.theory import RING_SERIES
from hdcal.report.chart_spec import BLUE, ORANGE, Chart, Line, Mark, Panel

_profile = jit(ring_profile, static_argnames=("terms",))
# Terms of the shorter series.
_FEW = 3
# Title, y axis, and the label of each curve by its name in the profile.
_PANELS = (
    (
        "Displacement",
        "displacement [mm]",
        {"radial": "radial", "tangential": "tangential"},
    ),
    ("Bending moment", "moment [N·mm]", {"moment": ""}),
    ("Hoop stress, outer surface", "stress [MPa]", {"stress": ""}),
)


def ring_chart(geometry: Geometry, modulus: float, deformation: float) -> Chart:
    """Return shape, moment and stress around a ring, and the error of a short series.

    Args:
        geometry: sizes [mm].
        modulus: Young's modulus [MPa].
        deformation: radial displacement under each load [mm].
    """
    angle = np.linspace(0.0, np.pi, 181)
    whole = _profile(geometry, modulus, deformation, angle)
    few = _profile(geometry, modulus, deformation, angle, terms=_FEW)
    x, panels = np.degrees(angle), []
    for title, y, curves in _PANELS:
        exact: list[Mark] = []
        short: list[Mark] = []
        for (name, label), colour in zip(curves.items(), (BLUE, ORANGE), strict=False):
            look = {"x": x, "colour": colour}
            exact.append(Line(label=label, y=np.asarray(getattr(whole, name)), **look))
            terms, y_few = f"first {_FEW} terms", np.asarray(getattr(few, name))
            short.append(Line(label=terms, y=y_few, dash="dotted", **look))
        marks = exact + short
        panels.append(Panel(title=title, x="angle from a load [°]", y=y, marks=marks))
    return Chart(panels=[*panels, _truncation()], columns=2)


def _truncation() -> Panel:
    n = 2.0 * np.arange(1, 201)
    parts = {
        "displacement": (1.0 / (n**2 - 1.0) ** 2 / RING_SERIES, BLUE),
        "moment and stress": (1.0 / (n**2 - 1.0) / 0.5, ORANGE),
    }
    return Panel(
        title="Error of a truncated series at the load",
        x="terms of the series",
        y="relative error",
        marks=[
            Line(label=label, x=n / 2.0, y=1.0 - np.cumsum(share), colour=colour)
            for label, (share, colour) in parts.items()
        ],
        x_log=True,
        y_log=True,
    )
