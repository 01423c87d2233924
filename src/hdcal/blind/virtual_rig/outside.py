"""The mechanisms that stand in no library, by name.

A diagnosis that meets one of them has nothing to call it: the right answer is that
the cause is unknown. Size and sign are the caller's; so is the check that a programme
of measurements lets the mechanism show at all.
"""

from collections.abc import Callable

import numpy as np

from hdcal.blind.virtual_rig import outside_chosen as chosen
from hdcal.blind.virtual_rig import outside_late as late
from hdcal.blind.virtual_rig import outside_later as later
from hdcal.blind.virtual_rig import outside_listed as listed
from hdcal.blind.virtual_rig import outside_unseen as unseen
from hdcal.blind.virtual_rig.history import Floats, History

OutsideMechanism = Callable[[History, np.random.Generator], Floats]


def _by_name(*mechanisms: OutsideMechanism) -> dict[str, OutsideMechanism]:
    return {each.__name__: each for each in mechanisms}


LISTED = _by_name(
    listed.step_in_mounting,
    listed.hum,
    listed.angle_by_temperature,
    listed.direction_by_temperature,
    listed.thermal_lag,
    listed.crack,
    listed.random_walk,
)
"""Those that the specification gives."""

CHOSEN = _by_name(
    chosen.burr,
    chosen.tooth_catch,
    chosen.snap_through,
    chosen.edge_rollover,
    chosen.stick_slip,
    chosen.crushed_chip,
    chosen.foreign_stop,
    chosen.closing_gap,
    chosen.hard_spot,
    chosen.side_drag,
    chosen.parallax,
    chosen.range_switch,
    chosen.running_in,
    chosen.late_channel,
    chosen.loose_connector,
    chosen.tare_by_cycle,
    chosen.draught,
)
"""Those chosen from what goes wrong on rigs, without sight of the diagnosis."""

UNSEEN = _by_name(
    unseen.binding_guide,
    unseen.oil_suction,
    unseen.wrinkling,
    unseen.worn_track,
    unseen.virgin_pad,
    unseen.lost_steps,
    unseen.two_seats,
    unseen.walking_ring,
    unseen.skidding_punch,
    unseen.hot_creep,
    unseen.dew,
    unseen.heater_pickup,
    unseen.hasty_reader,
    unseen.peak_hold,
    unseen.uneven_bits,
    unseen.dying_battery,
    unseen.hunting_drive,
)
"""Chosen after the method was settled, and shown to it in the published round only."""

LATE = _by_name(
    late.healing_pad,
    late.transforming_clip,
    late.growing_delamination,
    late.bunched_strip,
    late.set_grease,
    late.pinched_pin,
    late.creeping_roller,
    late.tilting_table,
    late.two_lips,
    late.starved_bearing,
    late.frame_gradient,
    late.swinging_thermostat,
    late.conducted_heat,
    later.clipped_below,
    later.inrush_crosstalk,
    later.slew_limit,
    later.drooping_hold,
    later.ground_loop,
    later.reversed_blocks,
    later.repeated_rows,
    later.bridged_gap,
    later.tare_under_load,
    later.fahrenheit_shift,
    later.smoothed_record,
)
"""Chosen for the second round, without sight of the library."""
