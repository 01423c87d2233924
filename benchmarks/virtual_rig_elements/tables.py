"""The two tables that the virtual rig reads in place of its finite elements."""

from pathlib import Path

import numpy as np

from benchmarks.virtual_rig_elements.cup import Cup, cup_stiffness
from benchmarks.virtual_rig_elements.end import End
from benchmarks.virtual_rig_elements.ring import Floats, Ring, load_curve, stiffness

FOLDER = Path(__file__).parents[2] / "src" / "hdcal" / "blind" / "virtual_rig"
RING = Ring(radius=40.0, thickness=0.68, length=70.0, modulus=207e3)
CUP = Cup(40.0, 70.0, ((50.0, 0.68), (70.0, 0.83)), 207e3, 0.29, End(2.5, 20.0))
# Where the loads of a cup without any shift of its line of contact stand [mm].
LOAD_HEIGHT = 62.0


def ring_table() -> Floats:
    """ω/R and F/(kω) of the ring, shape (46, 2); k is the slope at no load."""
    depth = np.arange(-10, 36) / 100.0
    rest = depth == 0.0
    force = load_curve(RING, depth * RING.radius)
    straight = stiffness(RING) * np.where(rest, 1.0, depth * RING.radius)
    return np.column_stack([depth, np.where(rest, 1.0, force / straight)])


def cup_table() -> Floats:
    """Height of the load [mm] and the cup's stiffness over that at 62 mm, (9, 2)."""
    heights = np.linspace(44.0, 68.0, 9)
    found = np.array([cup_stiffness(CUP, height) for height in heights])
    return np.column_stack([heights, found / found[heights == LOAD_HEIGHT]])


TABLES = {
    "ring.csv": (
        ring_table,
        """\
# A ring pressed by two opposed radial loads, large displacements.
# R = 40 mm, wall 0.68 mm, width 70 mm; 40 corotational beams per quarter.
# deformation_over_radius: radial displacement of one load over R [1]; negative pulls
# force_over_linear: force over slope at no load times displacement [1]
deformation_over_radius,force_over_linear
""",
    ),
    "cup.csv": (
        cup_table,
        """\
# A cup pressed by two opposed radial loads, small displacements.
# R = 40 mm, L = 70 mm, wall 0.68 mm, from 50 mm up 0.83 mm; E = 207 GPa, nu = 0.29;
# its end a disc of 2.5 mm round a rigid hub of 20 mm radius. Shell elements.
# load_height_mm: of the loads above the end [mm]
# relative_stiffness: radial stiffness over that with the loads at 62 mm [1]
load_height_mm,relative_stiffness
""",
    ),
}


def text(name: str) -> str:
    """Return a table's file; numbers with all their digits."""
    made, head = TABLES[name]
    return head + "".join(f"{x!r},{y!r}\n" for x, y in made().tolist())
