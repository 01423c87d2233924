"""The JSON answer of the audit: every claim, and the fits behind them."""

from dataclasses import dataclass
from typing import Literal

from hdcal.classical.audit.article import Claim
from hdcal.report.answer import Answer


@dataclass(frozen=True)
class AuditedData:
    """Which data the claims were held against."""

    name: str
    sha256: str


@dataclass(frozen=True)
class AuditedFit:
    """A least-squares polynomial on Table 2."""

    model: str
    coefficients: tuple[float, ...]
    s_N: float
    r2: float | None


@dataclass(frozen=True)
class PrintedCurve:
    """The article's own cubic on Table 2."""

    model: str
    rms_N: float
    r2: float


@dataclass(frozen=True, kw_only=True)
class AuditAnswer(Answer):
    """What `hdcal audit` answers; audit.json."""

    schema: Literal["hdcal.audit/1"] = "hdcal.audit/1"
    article: str
    data: AuditedData
    count: dict[str, int]
    claims: tuple[Claim, ...]
    fits: tuple[AuditedFit | PrintedCurve, ...]
