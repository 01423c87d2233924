"""How a result was made: priors, sampling, versions, command."""

from hdcal.inference.posterior import Posterior
from hdcal.report.page import (
    gear_rows,
)
from hdcal.report.words import label, prior_words


def prior_rows(posterior: Posterior) -> list[dict]:
    """Return the priors as texts of a table's rows."""
    shown = [name for name in posterior.priors if name in posterior.draws]
    return [
        {
            "label": label(name),
            "words": prior_words(name, posterior.priors[name]),
            "source": posterior.priors[name].source or "the gear file",
        }
        for name in shown
    ]


def provenance_rows(posterior: Posterior, summary: dict, command: str) -> list:
    """Return how a calibration was made, as pairs of name and words."""
    sampling = summary["sampling"]
    rows = [
        *gear_rows(posterior.case, posterior.theory),
        ("effects", ", ".join(effect.name for effect in posterior.effects) or "none"),
        (
            "sampling",
            f"NUTS, {sampling['chains']} chains of {sampling['draws']} draws after "
            f"{sampling['warmup']} of warm-up, seed {summary['seed']}",
        ),
        ("seconds", f"{sampling['seconds']:.1f}"),
        ("versions", ", ".join(f"{k} {v}" for k, v in summary["versions"].items())),
    ]
    return rows + ([("command", command)] if command else [])
