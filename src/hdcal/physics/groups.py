"""Groups of effects: causes that look alike in most loadings, or have one remedy."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Group:
    """What can be said and done before the one effect is known.

    The texts name {load} and {displacement}, for `Quantities.say`.

    Attributes:
        meaning: what the causes have in common, to follow "that is".
        remedy: what helps against any of them.
        run: what tells its members apart.
    """

    meaning: str
    remedy: str
    run: str


GROUPS = {
    "curve up": Group(
        "the curve stiffens with the {displacement}",
        "preload or seat the gear before the first reading, look for a stop in reach, "
        "and have the displacement gauge calibrated over its range",
        "finer steps at small {displacement}s, then a run beyond the range",
    ),
    "curve down": Group(
        "the curve softens with the {displacement}",
        "stay in the lower half of the load cell's range, and allow for the softening "
        "of the gear's own geometry",
        "the same {load}s on a cell of twice the range; unloading shows a yield",
    ),
    "loop": Group(
        "loading and unloading differ",
        "calibrate on loading alone or on both in equal number, grease and free the "
        "guides, widen margins by half the loop, and see that the zero is after the "
        "test what it was before: a part that has yielded is another one",
        "small inner loops, and a second loading of the same specimen",
    ),
    "rate or time": Group(
        "the {load} depends on speed or on time",
        "read at one speed and after the same wait, and reset the amplifier before "
        "each run",
        "one run four times as fast and one hold of a minute",
    ),
    "zero over temperature": Group(
        "the zero moves with temperature",
        "zero the chain at each temperature, or keep the rig at one",
        "readings without load at each temperature",
    ),
    "slope over temperature": Group(
        "the slope changes with temperature beyond the material's modulus",
        "calibrate at the working temperature, and have the load cell's sensitivity "
        "compensated",
        "a check mass on the load cell at each temperature",
    ),
    "mounting or gear": Group(
        "mountings, gears or load cycles differ",
        "take several mountings and average over them, and say which gear is meant",
        "the same gear mounted anew three times",
    ),
    "angle": Group(
        "the stiffness goes with the angle",
        "read at several angles and average, or state the angle",
        "one turn in steps of thirty degrees",
    ),
    "screw": Group(
        "the error repeats along the stroke",
        "read the {displacement} by a gauge of its own instead of the screw",
        "steps of an eighth of the pitch over two turns",
    ),
    "rig": Group(
        "the rig gives way beside the gear",
        "measure the {displacement} between the points of load",
        "the bare rig against a block of steel",
    ),
    "noise": Group(
        "readings scatter otherwise than evenly",
        "repeat readings, and look for the source of wild or coarse ones",
        "twenty readings at one place",
    ),
}
