"""The library of effects in words: the only place of its sentences."""

from hdcal.calibration.effects.answer import EffectsAnswer
from hdcal.report.document import Document, Section, Table


def headline(count: int) -> str:
    """Return how many effects there are, in one sentence."""
    return f"{count} effects can be added to the model."


def effects_document(found: EffectsAnswer) -> Document:
    """Return the library as a table."""
    rows = []
    for effect in found.effects:
        first = [effect.name, effect.stage, ", ".join(effect.needs) or "–"]
        for item in effect.parameters:
            prior = item.prior or "none shipped"
            rows.append([*first, item.name, item.meaning, prior])
            first = ["", "", ""]
    columns = ["effect", "stage", "needs", "parameter", "meaning", "prior"]
    table = Table(columns, rows, names=frozenset({"effect"}))
    return Document(
        name="Library of effects",
        kind="effects",
        subtitle="what a calibration can include",
        headline=found.headline,
        sections=[Section("Effects and their parameters", [table], brief=True)],
    )
