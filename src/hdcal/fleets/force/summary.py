"""The force of gears to come as an answer, and all that its result folder holds."""

from hdcal.fleets.fleet_facts import FleetFacts
from hdcal.fleets.force.answer import ForceAnswer
from hdcal.fleets.force.document import force_words, whole_document
from hdcal.fleets.next_force import NextForce
from hdcal.report.intervals import INTERVAL
from hdcal.report.write import Report


def force_answer(found: NextForce, facts: FleetFacts) -> ForceAnswer:
    """Return a force as an answer, ready for JSON.

    Args:
        found: the force.
        facts: what the fleet's draws rest on.
    """
    said = tuple(force_words(found))
    return ForceAnswer(
        **vars(found),
        reasons=(),
        headline=said[0],
        next_step=None,
        answer=said,
        notes=facts.notes,
        interval=INTERVAL,
        fleet=facts.name,
        gears=facts.gears,
        rows=facts.rows,
        seed=facts.settings.seed,
        versions=facts.versions,
        data_sha256=facts.data_sha256,
    )


def force_report(
    found: NextForce, facts: FleetFacts, command: str = ""
) -> Report[ForceAnswer]:
    """Return all that `hdcal margin` leaves behind of a fleet."""

    def figures():
        from hdcal.fleets.force.figure import force_figure

        return {"force": force_figure(found, facts.name)}

    def charts():
        from hdcal.fleets.force.chart import force_chart

        return {"force": [force_chart(found)]}

    answer = force_answer(found, facts)
    document = whole_document(answer, facts, command)
    file = "next_force.json"
    return Report(document, answer, file, figures, charts=charts, theory=facts.theory)
