"""Audit the article: every claim against its own formula and its own readings."""

from typing import get_args

import numpy as np

from hdcal.classical.audit.article import TITLE, Claim, Outcome
from hdcal.classical.audit.data_claims import data_claims
from hdcal.classical.audit.theory_claims import cubic, theory_claims
from hdcal.classical.fit.fit import fit
from hdcal.classical.fit.summary import model_name
from hdcal.data.case import Case
from hdcal.data.reading import read_case
from hdcal.data.resources import datasets_folder

SCHEMA = "hdcal.audit/1"
_DATASET = "xb1-100-80"


def audit() -> tuple[Claim, ...]:
    """Check every claim of the article whose example gear and data are bundled.

    The article's own printed numbers are given; everything else is computed from
    the formula, from `ring`, and from its Table 2 by least squares.

    Returns:
        The claims in the order of the audit's points, 1 to 11.

    Source:
        "Study on Flexible Gear Deformation in Harmonic Drive Gear".
    """
    found = [*theory_claims(), *data_claims(_table_2())]
    return tuple(sorted(found, key=lambda claim: claim.point))


def _table_2() -> Case:
    return read_case(str(datasets_folder() / _DATASET))


def summarise_audit(claims: tuple[Claim, ...]) -> dict:
    """Return the audit as plain data, ready for JSON.

    Args:
        claims: from `audit`.
    """
    words = [claim.verdict for claim in claims]
    return {
        "schema": SCHEMA,
        "status": "ok",
        "article": TITLE,
        "data": {"name": _DATASET, "sha256": _table_2().data_sha256},
        "count": {word: words.count(word) for word in get_args(Outcome)},
        "claims": [vars(claim) for claim in claims],
        "fits": _fits(),
    }


def _fits() -> list[dict]:
    """Return the least-squares fits of Table 2, and the article's cubic beside them."""
    case = _table_2()
    x, y = np.asarray(case.records.deformation), np.asarray(case.records.force)
    rows = [
        {
            "model": model_name(one.powers),
            "coefficients": one.coefficients.tolist(),
            "s_N": one.s,
            "r2": one.r2,
        }
        for one in sorted(fit(case, [1, 2, 3]), key=lambda f: (len(f.powers), -f.dof))
    ]
    residual = y - cubic(x)
    r2 = float(1.0 - residual @ residual / np.sum((y - y.mean()) ** 2))
    rms = float(np.sqrt(np.mean(residual**2)))
    return [*rows, {"model": "the article's cubic", "rms_N": rms, "r2": r2}]
