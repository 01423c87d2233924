"""The effect interface: one mechanism, one stage of the measurement chain.

An effect is a frozen pytree. Class keywords declare what it is, fields are its
parameters, one method computes on whole ordered records. Only amplitudes have a null
value: there the effect changes nothing.
"""

import dataclasses
import re
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, Literal

import equinox as eqx
from jaxtyping import Float

from hdcal.data.records import Array, Records

Stage = Literal["deformation", "force", "sensor", "noise"]
PerRow = Float[Array, " n"]


@dataclasses.dataclass(frozen=True)
class Parameter:
    """What a parameter of an effect means: unit, meaning in one line, typical size.

    The effect vanishes at `null`, which is None for a shape parameter.
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
        metadata={"parameter": Parameter(unit, meaning, typical, null)}
    )


class Rows(eqx.Module):
    """The input of an effect: the records and the results of earlier stages.

    T − T_ref [K], K·k(E(T)) per radial displacement [N/mm], and the radial deformation
    of the gear [mm]; on the deformation stage the reading of the rig less its offset.
    """

    records: Records
    temperature_rise: PerRow
    stiffness: PerRow
    deformation: PerRow


class Noise(eqx.Module):
    """Reading noise as a mixture of normals: log weights [-] and sd of each [N]."""

    log_weight: Float[Array, " c"]
    sd: Float[Array, "c n"]


class Effect(eqx.Module, ABC):
    """One unmodelled mechanism of the rig or the gear.

    Its name, the key of the registry and prefix of the posterior sites, is that of the
    class in snake case. A subclass without a stage inherits all keywords from its base.

    Attributes:
        stage: where in the measurement chain it acts.
        family: kind of mechanism, such as "loop" or "rig".
        needs: features of the records without which it cannot be tested.
        instantaneous: whether it is a force or play of the gear itself that depends on
            the moment only; `hdcal respond` leaves other effects out.
        mixture: whether the noise of a reading becomes more than one normal.
        period: name of the shape parameter that is a period in radial deformation [mm],
            for an effect with several amplitudes that shorter records cannot show.
    """

    name: ClassVar[str]
    stage: ClassVar[Stage]
    family: ClassVar[str]
    needs: ClassVar[frozenset[str]]
    instantaneous: ClassVar[bool]
    mixture: ClassVar[bool]
    period: ClassVar[str]

    def __init_subclass__(
        cls,
        *,
        stage: Stage | None = None,
        family: str = "",
        needs: Sequence[str] = (),
        instantaneous: bool = False,
        mixture: bool = False,
        period: str = "",
    ) -> None:
        if stage is None:
            return
        if not family or isinstance(needs, str):
            raise TypeError(f"{cls.__name__}: give a family, and needs as a tuple")
        cls.name = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", cls.__name__).lower()
        cls.stage, cls.family, cls.needs = stage, family, frozenset(needs)
        cls.instantaneous, cls.mixture, cls.period = instantaneous, mixture, period

    @abstractmethod
    def apply(self, signal: Any, rows: Rows) -> Any:
        """Return the signal of this effect's stage, changed by the effect.

        The signal is the radial deformation [mm] on the deformation stage, the force
        [N] on the force and sensor stages, `Noise` on the noise stage. A row may depend
        on itself and on rows before it, never on the number of rows: copies of the last
        one may follow, and must change nothing before them.
        """


def parameters(effect: type[Effect] | Effect) -> dict[str, Parameter]:
    """Return the declared parameters of an effect, by field name."""
    return {
        field.name: field.metadata["parameter"]
        for field in dataclasses.fields(effect)
        if "parameter" in field.metadata
    }
