"""The mechanisms that stand in no library, by name.

A diagnosis that meets one of them has nothing to call it: the right answer is that
the cause is unknown. Size and sign are the caller's; so is the check that a programme
of measurements lets the mechanism show at all.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hdcal.blind.virtual_rig import outside_chosen as chosen
from hdcal.blind.virtual_rig import outside_listed as listed
from hdcal.blind.virtual_rig import outside_unseen as unseen
from hdcal.blind.virtual_rig.history import History

Mechanism = Callable[[History, np.random.Generator], NDArray[np.float64]]

LISTED: dict[str, Mechanism] = {
    "step_in_mounting": listed.step_in_mounting,
    "hum": listed.hum,
    "angle_by_temperature": listed.angle_by_temperature,
    "direction_by_temperature": listed.direction_by_temperature,
    "thermal_lag": listed.thermal_lag,
    "crack": listed.crack,
    "random_walk": listed.random_walk,
}
"""Those that the specification gives."""

CHOSEN: dict[str, Mechanism] = {
    "burr": chosen.burr,
    "tooth_catch": chosen.tooth_catch,
    "snap_through": chosen.snap_through,
    "edge_rollover": chosen.edge_rollover,
    "stick_slip": chosen.stick_slip,
    "crushed_chip": chosen.crushed_chip,
    "foreign_stop": chosen.foreign_stop,
    "closing_gap": chosen.closing_gap,
    "hard_spot": chosen.hard_spot,
    "side_drag": chosen.side_drag,
    "parallax": chosen.parallax,
    "range_switch": chosen.range_switch,
    "running_in": chosen.running_in,
    "late_channel": chosen.late_channel,
    "loose_connector": chosen.loose_connector,
    "tare_by_cycle": chosen.tare_by_cycle,
    "draught": chosen.draught,
}
"""Those chosen from what goes wrong on rigs, without sight of the diagnosis."""

UNSEEN: dict[str, Mechanism] = {
    "binding_guide": unseen.binding_guide,
    "oil_suction": unseen.oil_suction,
    "wrinkling": unseen.wrinkling,
    "worn_track": unseen.worn_track,
    "virgin_pad": unseen.virgin_pad,
    "lost_steps": unseen.lost_steps,
    "two_seats": unseen.two_seats,
    "walking_ring": unseen.walking_ring,
    "skidding_punch": unseen.skidding_punch,
    "hot_creep": unseen.hot_creep,
    "dew": unseen.dew,
    "heater_pickup": unseen.heater_pickup,
    "hasty_reader": unseen.hasty_reader,
    "peak_hold": unseen.peak_hold,
    "uneven_bits": unseen.uneven_bits,
    "dying_battery": unseen.dying_battery,
    "hunting_drive": unseen.hunting_drive,
}
"""Chosen after the method was settled, and shown to it in the published round only."""
