"""The effect interface: one mechanism, one stage of the measurement chain.

An effect is a frozen pytree. Class attributes declare what it is, fields are
its parameters, one method computes on whole ordered records. Only amplitudes
have a null value: there the effect changes nothing.
"""

import dataclasses
from abc import ABC, abstractmethod
from typing import Any, ClassVar, Literal

import equinox as eqx
from jaxtyping import Float

from hdcal.data.records import Array, Records

Stage = Literal["deformation", "force", "sensor", "noise"]


@dataclasses.dataclass(frozen=True)
class Parameter:
    """What a parameter of an effect means.

    Attributes:
        unit: unit in code units.
        meaning: one line for people.
        null: the value at which the effect vanishes; None for a shape parameter.
        typical: a physically ordinary size, used by tests and illustrations.
    """

    unit: str
    meaning: str
    typical: float
    null: float | None = None


def parameter(
    unit: str, meaning: str, *, typical: float, null: float | None = None
) -> Any:
    """Declare a field of an effect as a parameter."""
    return dataclasses.field(
        metadata={"parameter": Parameter(unit, meaning, typical, null)},
    )


class Rows(eqx.Module):
    """What an effect may look at: the records and what earlier stages made of them.

    Attributes:
        records: the measured rows.
        temperature_rise: T − T_ref [K].
        stiffness: K·k(E(T)) per radial displacement [N/mm].
        deformation: radial, as the gear sees it [mm]; the rig's own reading less
            its offset while the deformation stage still runs.
    """

    records: Records
    temperature_rise: Float[Array, " n"]
    stiffness: Float[Array, " n"]
    deformation: Float[Array, " n"]


class Noise(eqx.Module):
    """Reading noise as a mixture of normals, one column per row of the data.

    Attributes:
        log_weight: log of the mixture weights [-].
        sd: standard deviation of each component [N].
    """

    log_weight: Float[Array, " c"]
    sd: Float[Array, "c n"]


class Effect(eqx.Module, ABC):
    """One unmodelled mechanism of the rig or the gear.

    Class attributes:
        name: key of the registry and prefix of the posterior sites.
        stage: where in the measurement chain it acts.
        needs: features of the records without which it cannot be tested.
        groups: of `physics.groups`; those of one look alike or have one remedy.
        symmetry: how the contribution answers to tension instead of compression,
            `odd` (changes sign), `even` (does not) or `none` (neither, or by history).
        mixture: whether a reading's noise becomes more than one normal.
        period: of an effect with several amplitudes, its shape parameter that is a
            period in radial deformation [mm]. Records of less than one period show a
            bend like any other, and not this effect, unless its prior says so.
        acts_at_once: whether it is a force or play of the gear itself that depends on
            deformation, speed and temperature of the moment only; `hdcal respond`
            takes such effects along and leaves others out.
        twin: what obeys the same equation and is no effect of the library.
    """

    # What each effect says of itself.
    told: ClassVar[tuple[str, ...]] = ("name", "stage", "groups")
    name: ClassVar[str]
    stage: ClassVar[Stage]
    groups: ClassVar[tuple[str, ...]]
    needs: ClassVar[frozenset[str]] = frozenset()
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "odd"
    mixture: ClassVar[bool] = False
    period: ClassVar[str] = ""
    acts_at_once: ClassVar[bool] = False
    twin: ClassVar[str] = ""

    def __post_init__(self) -> None:
        missing = [name for name in self.told if not hasattr(self, name)]
        if missing:
            words = f"{type(self).__name__} is no effect without {', '.join(missing)}"
            raise TypeError(words)

    @abstractmethod
    def apply(self, signal: Any, rows: Rows) -> Any:
        """Return the signal of this effect's stage as the effect leaves it.

        A row may depend on itself and on rows before it, never on the number of rows:
        copies of the last one may follow, and must change nothing before them.

        Args:
            signal: radial deformation [mm] on the deformation stage, force [N] on
                the force and sensor stages, `Noise` on the noise stage.
            rows: the covariates and earlier stages.
        """


def parameters(effect: type[Effect] | Effect) -> dict[str, Parameter]:
    """Return the declared parameters of an effect, by field name."""
    return {
        field.name: field.metadata["parameter"]
        for field in dataclasses.fields(effect)
        if "parameter" in field.metadata
    }
