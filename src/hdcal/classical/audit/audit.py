"""Audit the article: every claim against its own formula and its own readings."""

from hdcal.classical.audit.article import Claim
from hdcal.classical.audit.data_claims import data_claims
from hdcal.classical.audit.theory_claims import theory_claims
from hdcal.data.case import Case
from hdcal.data.reading import read_case
from hdcal.data.resources import datasets_folder

DATASET = "xb1-100-80"


def audit() -> tuple[Claim, ...]:
    """Check every claim of the article whose example gear and data are bundled.

    The article's own printed numbers are given; everything else is computed from
    the formula, from `ring`, and from its Table 2 by least squares.

    Returns:
        The claims in the order of the audit's points, 1 to 11.

    Source:
        "Study on Flexible Gear Deformation in Harmonic Drive Gear".
    """
    found = [*theory_claims(), *data_claims(table_2())]
    return tuple(sorted(found, key=lambda claim: claim.point))


def table_2() -> Case:
    """Return the readings of the article's Table 2, as they are bundled."""
    return read_case(str(datasets_folder() / DATASET))
