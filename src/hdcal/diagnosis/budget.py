"""The scale factor K as a product of physical factors."""

from dataclasses import dataclass
from typing import Literal

from hdcal.report.answer import Words
from hdcal.report.intervals import Interval


@dataclass(frozen=True)
class BudgetPart:
    """One physical reason why K is not 1.

    Attributes:
        name: for people.
        factor: posterior of the factor, 95 % interval [-].
        prior: the same before the data.
        driven_by: prior or data.
        split_by: the extra run or measurement that would tell it from the others.
    """

    name: Words
    factor: Interval
    prior: Interval
    driven_by: Literal["prior", "data"]
    split_by: str


@dataclass(frozen=True)
class Budget:
    """K as a product of physical factors; one curve gives only the product.

    Attributes:
        K: at the prior's mean modulus, beside the named effects.
        formula: theory whose K this is.
        parts: whose product it is.
        note: in words.
    """

    K: Interval
    formula: Literal["ring", "cup", "article"]
    parts: tuple[BudgetPart, ...]
    note: str
