"""A response as an answer, and all that its result folder holds."""

import numpy as np

from hdcal.motion.dynamic_posterior import DynamicPosterior
from hdcal.motion.respond.answer import (
    QuantityEstimate,
    ResponseAnswer,
    ResponseWithColumns,
)
from hdcal.motion.respond.document import headline, next_steps, response_document
from hdcal.motion.respond.respond import Response
from hdcal.report.intervals import INTERVAL
from hdcal.report.write import Report


def response_answer(response: Response) -> ResponseAnswer:
    """Return a response without its rows as an answer, ready for JSON."""
    posterior = response.posterior
    moving = isinstance(posterior, DynamicPosterior)
    estimates = {n: QuantityEstimate(**one) for n, one in response.estimates.items()}
    steps = next_steps(posterior, estimates)
    return ResponseAnswer(
        status="ok",
        reasons=(),
        headline=headline(
            estimates["peak_mm"], pulled=bool(np.min(response.force_N) < 0.0)
        ),
        next_step=steps[0] if steps else None,
        gear=posterior.case.gear.name,
        calibration="moving" if moving else "at rest",
        force=response.request.words,
        temperature_C=response.temperature_C,
        estimates=estimates,
        interval=INTERVAL,
        interval_kind="equal-tailed pointwise credible band of the deformation of "
        "gears like the tested one, without reading noise",
        tested_share=float(np.mean(response.tested)),
        effects=response.effects,
        left_out=response.left_out,
        remarks=response.remarks,
        draws=response.draws,
        points=len(response.time_s),
    )


def response_report(response: Response, command: str = "") -> Report[ResponseAnswer]:
    """Return all that `hdcal respond` leaves behind."""

    def figures():
        from hdcal.motion.figure import response_figure

        return {"response": response_figure(response)}

    def charts():
        from hdcal.motion.respond.chart import response_charts

        return {"response": response_charts(response)}

    found = response_answer(response)
    return Report(
        response_document(response, found, command),
        found,
        "response.json",
        figures,
        tables=lambda: {"response.csv": response.columns()},
        charts=charts,
        theory=response.posterior.case.gear.theory,
    )


def with_columns(found: ResponseAnswer, response: Response) -> ResponseWithColumns:
    """Return the answer with the rows beside it."""
    columns = {name: rows.tolist() for name, rows in response.columns().items()}
    return ResponseWithColumns(**vars(found), columns=columns)
