"""Mechanisms outside the library: heat.

Every public function is one of them, see `outside`.
"""

import numpy as np

from benchmarks.blind.rig.history import (
    Floats,
    History,
    beyond,
    drawn_place,
    followed,
    swing,
    to_one,
)


def angle_by_temperature(history: History, rng: np.random.Generator) -> Floats:
    """The fixture grips unevenly around the ring, and heat changes the grip."""
    lobes = rng.integers(1, 3)
    around = np.cos(lobes * (history.angle - rng.uniform(0, 2 * np.pi)))
    return history.relative_deformation * around * (history.warmer / 10.0)


def closing_gap(history: History, rng: np.random.Generator) -> Floats:
    """A gap between ring and fixture closes by heat, so it is met earlier when warm."""
    # An aluminium frame of one to three hundred millimetres, mm per °C.
    rate = rng.uniform(0.0025, 0.006)
    gap = drawn_place(history, rng, 0.5, 0.75) - rate * history.warmer
    return beyond(history, gap)


def transforming_clip(history: History, rng: np.random.Generator) -> Floats:
    """A clip of shape memory alloy changes its phase under load, and changes back."""
    share, span = history.relative_deformation, rng.uniform(0.15, 0.3)
    there = rng.uniform(0.4, 0.6) + rng.uniform(0.002, 0.007) * history.warmer
    least = np.clip((share - there) / span, 0.0, 1.0)
    most = np.clip((share - there + rng.uniform(0.15, 0.3)) / span, 0.0, 1.0)
    transformed = least.copy()
    for row in range(1, len(share)):
        transformed[row] = np.clip(transformed[row - 1], least[row], most[row])
    return -transformed


def thermal_lag(history: History, rng: np.random.Generator) -> Floats:
    """The specimen follows the thermometer late, exponentially in time."""
    constant = history.run_length * np.exp(rng.uniform(np.log(0.04), np.log(0.3)))
    lag, kept = np.zeros(len(history.order)), np.exp(-history.steps / constant)
    for row in range(1, len(lag)):
        change = history.temperature[row] - history.temperature[row - 1]
        # A change is met in full by the row that first shows it; waiting comes after.
        lag[row] = lag[row - 1] * kept[row] - change
    share = rng.random()
    return lag / 10.0 * (share + (1 - share) * history.relative_deformation)


def frame_gradient(history: History, rng: np.random.Generator) -> Floats:
    """The frame warms from outside, and bows until its core has followed."""
    skin = history.run_length * rng.uniform(0.04, 0.12)
    core = history.run_length * rng.uniform(0.25, 0.6)
    outside = followed(history.temperature, skin, history)
    return (outside - followed(history.temperature, core, history)) / 10.0


def swinging_thermostat(history: History, rng: np.random.Generator) -> Floats:
    """The chamber's thermostat knows on and off only, so the heat swings."""
    beat = history.run_length * rng.uniform(0.1, 0.3)
    rising = np.clip(0.15 + history.rise / rng.uniform(45.0, 75.0), 0.1, 0.9)
    width = np.maximum(history.rise, 3.0) / 30.0
    return width * swing(history.time / beat + rng.random(), rising)


def conducted_heat(history: History, rng: np.random.Generator) -> Floats:
    """The harder the hot ring is pressed, the more heat it gives to the load cell."""
    constant = history.run_length * rng.uniform(0.05, 0.2)
    flow = history.relative_deformation ** rng.uniform(0.5, 1.5) * history.rise / 15.0
    return followed(flow, constant, history)


def hot_creep(history: History, rng: np.random.Generator) -> Floats:
    """The glue under the strain gauges gives way under load, the faster the hotter."""
    doubling = rng.uniform(5.0, 12.0)
    speed = history.relative_deformation * 2 ** (history.warmer / doubling)
    return to_one(np.cumsum(speed * history.steps))


def draught(history: History, rng: np.random.Generator) -> Floats:
    """A door opens now and then, and cold air passes over the load cell."""
    curve = np.zeros(len(history.order))
    for _ in range(rng.integers(2, 5)):
        here = history.run == rng.choice(np.unique(history.run))
        opened = rng.uniform(0.05, 0.8) * np.max(history.time[here])
        swing = rng.uniform(0.03, 0.1) * history.run_length
        since = np.maximum(history.time - opened, 0.0) / swing
        curve += here * rng.uniform(0.5, 1.0) * since * np.exp(1 - since)
    return curve


def dew(history: History, rng: np.random.Generator) -> Floats:
    """Dew settles on the bare bridge while it is cold, and dries off when warm."""
    cold = history.temperature < rng.uniform(24.0, 33.0)
    growth = history.run_length * rng.uniform(0.3, 1.0)
    drying = history.run_length * rng.uniform(0.05, 0.2)
    kept = np.exp(-history.steps / np.where(cold, growth, drying))
    film = np.zeros(len(history.order))
    for row in range(1, len(film)):
        film[row] = cold[row] + (film[row - 1] - cold[row]) * kept[row]
    return film


def heater_pickup(history: History, rng: np.random.Generator) -> Floats:
    """The heater's current shifts the zero as long as its relay is closed."""
    beat = history.run_length * rng.uniform(0.08, 0.25)
    duty = np.clip(0.1 + history.rise / rng.uniform(45.0, 75.0), 0.05, 0.9)
    return ((history.time / beat + rng.random()) % 1 < duty).astype(float)


def fahrenheit_shift(history: History, rng: np.random.Generator) -> Floats:
    """For one shift the temperature is typed in as degrees Fahrenheit."""
    part, begin = history.order / len(history.order), rng.uniform(0.1, 0.6)
    here = (part >= begin) & (part < begin + rng.uniform(0.25, 0.4))
    excess = (0.8 * history.temperature + 32.0) / 60.0
    zero = rng.uniform(-0.2, 0.4)
    return here * excess * (zero + (1 - zero) * history.relative_deformation)
