"""A verdict as plain data: what verdict.json holds and every other view shows."""

from dataclasses import asdict

from hdcal.diagnosis.verdict import Cell, Verdict, Where, Which, member_files
from hdcal.diagnosis.words import answer, limits
from hdcal.inference.posterior import versions
from hdcal.prediction.engine.causes import SCHEMA
from hdcal.report.plain import as_plain

INTERVAL = 0.9


def verdict_json(verdict: Verdict, *, seed: int = 0, quick: bool = False) -> dict:
    """Return a verdict as plain data, ready for JSON.

    Args:
        verdict: from `diagnose`.
        seed: it was made with.
        quick: whether nothing was sampled.
    """
    case = verdict.case
    found = as_plain(
        {
            "schema": SCHEMA,
            "status": verdict.status,
            "reasons": verdict.reasons,
            "answer": [],
            "limits": [],
            "interval": INTERVAL,
            "gap": asdict(verdict.gap),
            "where": _where(verdict.where),
            "which": _which(verdict.which),
            "shrink": asdict(verdict.shrink),
            "next_test": [asdict(run) for run in verdict.next_test],
            "next_test_reason": verdict.no_run,
            "budget": asdict(verdict.budget),
            "refits": [
                {
                    "hypothesis": name,
                    "probability": verdict.posteriors[name][0],
                    "file": f,
                }
                for name, f in member_files(verdict).items()
            ],
            "library": verdict.library,
            "notes": verdict.notes,
            "seed": seed,
            "quick": quick,
            "versions": versions(),
            "gear": {
                "name": case.gear.name,
                "material": case.gear.material,
                "theory": case.gear.theory,
            },
            "data": {
                "name": case.name,
                "rows": len(case.records.force),
                "averaged_rows": verdict.averaged_rows,
                "rows_diagnosed": len(verdict.where.records.force),
                "sha256": case.data_sha256,
                "notes": case.notes,
            },
        }
    )
    return {**found, "answer": answer(found), "limits": limits(found)}


def _where(where: Where) -> dict:
    return {
        "p_value": where.p_value,
        "statistics": where.statistics,
        "shares": [asdict(share) for share in where.shares],
        "regions": [_cell(cell) for cell in where.regions],
        "cells": [_cell(cell) for cell in where.cells],
    }


def _cell(cell: Cell) -> dict:
    low, high = cell.bias_N - cell.half_width_N, cell.bias_N + cell.half_width_N
    return {
        "covariate": cell.covariate,
        "label": cell.label,
        "from": cell.start,
        "to": cell.stop,
        "unit": cell.unit,
        "rows": cell.rows,
        "bias_N": {"median": cell.bias_N, "lo": low, "hi": high},
        "z": cell.z,
        "share": cell.share,
    }


def _which(which: Which) -> dict:
    size, lacking = which.amplitude, which.not_testable.items()
    flat = size and {
        "effect": size.effect,
        "parameter": size.parameter,
        "unit": size.unit,
        **asdict(size.size),
    }
    return {
        **asdict(which),
        "amplitude": flat,
        "not_testable": [{"effect": name, "needs": needs} for name, needs in lacking],
    }
