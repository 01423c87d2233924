"""`hdcal calibrate`: from measurements to a result folder."""

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import (
    case_options,
    folder_options,
    json_option,
    read_given,
    sampling_options,
    take_reading,
)
from hdcal.errors import Finding


@command(short_help="Calibrate the force model against measurements.")
@case_options
@click.option(
    "--effect",
    "effects",
    metavar="NAME",
    multiple=True,
    help="Include an effect of the library. May be repeated.",
)
@click.option(
    "--with-gap/--no-gap",
    default=None,
    help="Include a smooth discrepancy in the model, or not [default: included if the "
    "readings show curvature; never with an effect].",
)
@click.option(
    "--dynamic",
    is_flag=True,
    help="Calibrate mass, damping and stiffness from the motion of a gear.",
)
@sampling_options
@folder_options("Write the result to DIR [default: NAME-calibration].")
@json_option
@click.pass_obj
def calibrate(console: Console, data, out, force, dynamic, **settings):
    """Calibrate the force model against DATA and write a result folder.

    With --dynamic DATA is a time series (time_s, deformation_mm, force_N) of one gear
    in motion.
    """
    from hdcal.calibration.calibrate import choose_effects
    from hdcal.cli.progress import progress_bar
    from hdcal.inference.posterior_file import FILE_NAME
    from hdcal.inference.sample import check_settings

    with console.wrong as wrong:
        effects = settings["effects"]
        for name in ("with_gap", "effects") if dynamic else ():
            if settings.pop(name):
                words = "cannot be combined with --dynamic"
                wrong.append(Finding(name, words, "Leave it out"))
        size = ("chains", "warmup", "draws", "seed")
        wrong.attempt(check_settings, **{name: settings[name] for name in size})
        wrong.attempt(choose_effects, effects)
        reading = take_reading(settings)
        case = read_given(console, data, **reading)
        plain = not (dynamic or effects) and settings.get("with_gap") is None
        if plain and case is not None:
            from hdcal.calibration.straight_line import takes_straight_part
            from hdcal.screening.working_range import STRAIGHT

            if takes_straight_part(case):
                case = read_given(console, data, **{**reading, "range": STRAIGHT})
        # Refused now, not after minutes of sampling.
        if out is None and case is not None:
            out = f"{case.name}-calibration"
        console.reserve_folder(out, force)
    assert case is not None and out is not None
    for note in case.notes:
        console.words(note)
    if dynamic:
        from hdcal.motion.dynamic_calibration import calibrate_dynamic as sample
        from hdcal.motion.dynamic_calibration import dynamic_calibration_of

        with progress_bar() as progress:
            posterior = sample(case, progress=progress, **settings)
        found = dynamic_calibration_of(posterior)
        files = {"figures": ["motion"], "tables": {"motion.csv": found.bands}}
    else:
        from hdcal.calibration.calibrate import calibrate as sample
        from hdcal.calibration.calibration import calibration_of

        with progress_bar() as progress:
            posterior = sample(case, progress=progress, **settings)
        found = calibration_of(posterior)
        bands = found.bands.to_frame()
        files = {"figures": ["calibration"], "tables": {"bands.csv": bands}}
    return console.show(found, **files, others={FILE_NAME: posterior.to_netcdf})
