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
Symmetry = Literal["odd", "even", "none"]
PerRow = Float[Array, " n"]


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
    """The input of an effect: the records and the results of earlier stages.

    Attributes:
        records: the measured rows.
        temperature_rise: T − T_ref [K].
        stiffness: K·k(E(T)) per radial displacement [N/mm].
        deformation: radial deformation of the gear [mm]; on the deformation stage
            the reading of the rig less its offset.
    """

    records: Records
    temperature_rise: PerRow
    stiffness: PerRow
    deformation: PerRow


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

    Its name, the key of the registry and prefix of the posterior sites, is that of the
    class in snake case. The attributes are declared by keywords of the class. A
    subclass without a stage inherits all of them, and the name, from its base.

    Attributes:
        stage: where in the measurement chain it acts.
        groups: of `physics.groups`; effects of a group look alike or share a remedy.
        needs: features of the records without which it cannot be tested.
        symmetry: how the contribution changes from compression to tension: `odd`
            (changes sign), `even` (does not) or `none` (neither, or by history).
        instantaneous: whether it is a force or play of the gear itself that depends
            on deformation, speed and temperature of the moment only; `hdcal respond`
            includes such effects and leaves others out.
        mixture: whether the noise of a reading becomes more than one normal.
        period: name of the shape parameter that is a period in radial deformation
            [mm], for an effect with several amplitudes. Records shorter than one
            period cannot show the effect, unless its prior says so.
        twin: a mechanism outside the library that obeys the same equation.
    """

    name: ClassVar[str]
    stage: ClassVar[Stage]
    groups: ClassVar[tuple[str, ...]]
    needs: ClassVar[frozenset[str]]
    symmetry: ClassVar[Symmetry]
    instantaneous: ClassVar[bool]
    mixture: ClassVar[bool]
    period: ClassVar[str]
    twin: ClassVar[str]

    def __init_subclass__(
        cls,
        *,
        stage: Stage | None = None,
        groups: Sequence[str] = (),
        needs: Sequence[str] = (),
        symmetry: Symmetry = "odd",
        instantaneous: bool = False,
        mixture: bool = False,
        period: str = "",
        twin: str = "",
    ) -> None:
        if stage is None:
            return
        if not groups or isinstance(groups, str) or isinstance(needs, str):
            words = "groups and needs are tuples of names, and groups is not empty"
            raise TypeError(f"{cls.__name__}: {words}")
        cls.name = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", cls.__name__).lower()
        cls.stage, cls.groups = stage, tuple(groups)
        cls.needs, cls.symmetry = frozenset(needs), symmetry
        cls.instantaneous, cls.mixture = instantaneous, mixture
        cls.period, cls.twin = period, twin

    @abstractmethod
    def apply(self, signal: Any, rows: Rows) -> Any:
        """Return the signal of this effect's stage, changed by the effect.

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
