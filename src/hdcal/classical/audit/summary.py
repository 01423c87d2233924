"""The audit as an answer."""

from typing import get_args

import numpy as np

from hdcal.classical.audit.answer import (
    AuditAnswer,
    AuditedData,
    AuditedFit,
    PrintedCurve,
)
from hdcal.classical.audit.article import TITLE, Claim, Outcome
from hdcal.classical.audit.audit import DATASET, table_2
from hdcal.classical.audit.data_claims import cubic_misfit
from hdcal.classical.audit.document import headline
from hdcal.classical.fit.fit import fit
from hdcal.classical.fit.notation import model_name


def audit_answer(claims: tuple[Claim, ...]) -> AuditAnswer:
    """Return the audit as an answer, ready for JSON."""
    words = [claim.verdict for claim in claims]
    count = {word: words.count(word) for word in get_args(Outcome)}
    return AuditAnswer(
        status="ok",
        reasons=(),
        headline=headline(count),
        next_step=None,
        article=TITLE,
        data=AuditedData(DATASET, table_2().data_sha256),
        count=count,
        claims=claims,
        fits=_fits(),
    )


def _fits() -> tuple[AuditedFit | PrintedCurve, ...]:
    """Return the least-squares fits of Table 2, and the article's cubic beside them."""
    case = table_2()
    x, y = np.asarray(case.records.deformation), np.asarray(case.records.force)
    rows = [
        AuditedFit(model_name(one.powers), tuple(one.coefficients), one.s, one.r2)
        for one in sorted(fit(case, [1, 2, 3]), key=lambda f: (len(f.powers), -f.dof))
    ]
    _, rms, r2 = cubic_misfit(x, y)
    return (*rows, PrintedCurve("the article's cubic", rms, r2))
