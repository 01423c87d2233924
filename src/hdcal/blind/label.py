"""What is sealed about a case, and what a diagnoser answered."""

from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from hdcal.data.typed_json import STRICT, Count, Name, Number, Share, Size, typed

CaseKind = Literal["null", "effect", "pair", "composite", "outside", "real"]
Quantiles = tuple[Number, Number, Number]


@dataclass(frozen=True)
class Label:
    """The truth about one case; only the opened seal shows it.

    Attributes:
        case: name of the case, the stem of its CSV.
        kind: null (nothing is missing), effect (one of the library's), pair (two of
            them), composite (one of them, and something outside beside it), outside
            (in no library), real (measured data with a stated cause).
        truth: names of what was switched on; of real data, of what may be answered.
        program: name of the loading.
        rows: number of readings n.
        r: RMS of what the effect leaves beside the base model, over the noise sd.
        noise: iid, ar (serial), or log (read faster than the rig moves).
        correlation: AR(1) coefficient of the noise.
        sigma: sd of the noise [N].
        spanned: of an outside mechanism, whether it is of the list that was given
            beforehand; None else.
        withheld: effects taken out of the library for this case.
        clean: readings without noise [N].
        curve: what the effect leaves beside the base model [N].
        amplitude: true value of a library parameter `effect.parameter` where the
            mechanism has just that one, in the library's unit.
        oracle: what Bayes' rule gives who knows r and the noise, by mechanism.
        mix: the part of the check that the case belongs to.
        beside: what lies outside the library beside the effect of a composite.
        share: of the square of a gap, what belongs to the effect.
    """

    __pydantic_config__ = STRICT

    case: str
    kind: CaseKind
    truth: tuple[Name, ...]
    program: Name
    rows: Count
    r: Size
    noise: Name
    correlation: Number
    sigma: Size
    spanned: bool | None = None
    withheld: tuple[Name, ...] = ()
    clean: tuple[Number, ...] = ()
    curve: tuple[Number, ...] = ()
    amplitude: dict[Name, Number] = field(default_factory=dict)
    oracle: dict[Name, Share] = field(default_factory=dict)
    mix: str = ""
    beside: str = ""
    share: Share = 1.0

    def plain(self) -> dict[str, Any]:
        """Return plain data, which is what a commitment is of.

        Without what sets of before composites have not.
        """
        composite = {"beside", "share"} if self.kind != "composite" else set()
        return {n: one for n, one in asdict(self).items() if n not in composite}

    @classmethod
    def from_plain(cls, data: dict[str, Any]) -> "Label":
        """Return the label of plain data, each number as it was written.

        Raises:
            ValueError: it is none.
        """
        typed(cls, data)
        lists = ("truth", "withheld", "clean", "curve")
        made: dict[str, Any] = {
            name: tuple(value) if name in lists else value
            for name, value in data.items()
        }
        return cls(**made)


@dataclass(frozen=True)
class CaseAnswer:
    """What a diagnoser says of one case; the words are those of verdict.json.

    Attributes:
        case: name of the case.
        verdict: none, named, group, ambiguous or unknown.
        effect: most probable effect, None where nothing is named.
        second_effect: another that is present beside it.
        set: smallest set of hypotheses with 90 %, most probable first.
        probabilities: of all hypotheses; they sum to 1.
        inclusion: of each effect over all hypotheses that hold it.
        detected: whether the residual test found a gap.
        p_value: of the residual test.
        gap: RMS of the gap, quantiles .5, .025, .975 [N].
        amplitude: value of a parameter `effect.parameter`, quantiles .5, .025,
            .975.
        closed: share closed on held-out rows, quantiles .5, .025, .975.
        noise_sd: of a reading [N].
        group: that leads, several where the loading cannot part them; empty where no
            group is said.
        group_members: effects of it.
        describes_best: `effect` alone describes the gap, and is not named only since
            other causes look like it too often.
    """

    __pydantic_config__ = STRICT

    case: str
    verdict: Literal["none", "named", "group", "ambiguous", "unknown"]
    effect: Name | None
    second_effect: Name | None
    set: tuple[Name, ...]
    probabilities: dict[Name, Share]
    inclusion: dict[Name, Share]
    detected: bool
    p_value: Share | None = None
    gap: Quantiles | None = None
    amplitude: dict[Name, Quantiles] = field(default_factory=dict)
    closed: Quantiles | None = None
    noise_sd: Size | None = None
    group: tuple[Name, ...] = ()
    group_members: tuple[Name, ...] = ()
    describes_best: bool = False

    @classmethod
    def from_plain(cls, data: dict[str, Any]) -> "CaseAnswer":
        """Return the answer of plain data.

        Raises:
            ValueError: it is none.
        """
        return typed(cls, data)
