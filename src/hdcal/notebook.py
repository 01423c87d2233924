"""How a result shows itself in a notebook: by the document that its room writes."""

from importlib import import_module

# Class of a result -> who tells of it; a name, so that nothing loads before it shows.
TELLERS = {
    "Bands": "prediction.bands.document.bands_document",
    "DynamicPosterior": "motion.summary.dynamic_report",
    "InverseDesign": "design.summary.inverse_report",
    "Margin": "prediction.margin.document.margin_document",
    "Posterior": "calibration.summary.calibration_report",
    "Response": "motion.respond.summary.response_report",
    "Study": "design.study.summary.study_report",
    "Verdict": "diagnosis.summary.verdict_report",
    "WaveGenerator": "design.summary.generator_report",
}


class Shown:
    """A result that shows what matters most of it in a notebook's cell."""

    def _repr_html_(self) -> str:
        known = (kind.__name__ for kind in type(self).__mro__)
        teller = next(TELLERS[name] for name in known if name in TELLERS)
        room, _, name = f"hdcal.{teller}".rpartition(".")
        told = getattr(import_module(room), name)(self)
        html = import_module("hdcal.report.html")
        return html.notebook_html(getattr(told, "document", told))
