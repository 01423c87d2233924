"""The mechanisms of the library's effects on the mean reading, by effect."""

from benchmarks.blind.rig.contact import CONTACT
from benchmarks.blind.rig.loops import LOOPS
from benchmarks.blind.rig.sensor import SENSOR
from benchmarks.blind.rig.temperature import TEMPERATURE
from benchmarks.blind.rig.time_effects import TIME
from benchmarks.blind.rig.virtual_rig import Mechanism

MECHANISMS: dict[str, Mechanism] = {
    **CONTACT,
    **LOOPS,
    **TIME,
    **TEMPERATURE,
    **SENSOR,
}
