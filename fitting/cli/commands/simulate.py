"""`mckibben simulate`: a data set from a model."""

from pathlib import Path
from typing import Any

import click

from fitting.cli.options import Command, effect_file_option, fitted_data_options, output_options
from fitting.cli.run import check_results, errors_for_machines

# as fitting.recordings.records has them, which would load jax for `--help`
KINDS = ("loop", "isometric", "static", "isotonic", "quick release", "step")


@click.command("simulate", cls=Command)
@click.argument("model")
@click.option("--test", default="loop", show_default=True, metavar="KIND", help=f"One of {', '.join(KINDS)}.")
@click.option(
    "--pressure",
    "--pressures",
    default="3 bar",
    show_default=True,
    metavar="LIST",
    help="Loop, static, release: each in turn. Isometric, isotonic: value to value. Step: before, after.",
)
@click.option("--turns", default="0,0.2,0", show_default=True, metavar="LIST", help="Loops: turning contractions.")
@click.option("--speed", default="10 mm/s", show_default=True, metavar="VALUE", help="Loops: speed.")
@click.option("--contraction", metavar="LIST", help="Held contractions: isometric 0, static 0 to 0.25 unless given.")
@click.option("--load", default="10 kg", show_default=True, metavar="LIST", help="Isotonic, release, step: hung loads.")
@click.option("--duration", metavar="VALUE", help="Of a release or step (1 s), or of one ramp of the pressure (5 s).")
@click.option("--rate", metavar="VALUE", help="Samples per second; 50 Hz, releases and steps 500 Hz.")
@click.option("--noise", metavar="VALUE", help="Standard deviation of one reading; none unless given.")
@click.option("--muscle", metavar="FILE", help="muscle.toml, where it is not the model file's muscle.")
@click.option(
    "--also", multiple=True, metavar="FILE", help="Another model of the same data; give it for each of a tie."
)
@fitted_data_options
@effect_file_option
@click.option("--out", required=True, metavar="FOLDER", help="Where the data set goes.")
@output_options
def command(**options: Any) -> None:
    """Write the data set that a rig would record if the muscle were as MODEL (a model.toml) says.

    Where the data that it was fitted to have nine runs of that kind of test, a file beside it has the band within which
    9 force readings of 10 of a real run like them would lie. Where several models explain the data, --also names the
    others: a file beside the data set has the force of each, and the mean that foretells runs left out best.
    """
    from fitting.cli.output import output
    from fitting.compiled.prepare import prepare
    from fitting.report.text.bands import simulated_band_result, simulated_band_texts
    from fitting.report.text.layout import line, lines
    from fitting.report.text.next_step import shell_words
    from fitting.report.text.several_models import several_models_result, several_models_texts
    from fitting.showing import counted

    prepare()
    check_results(options["json"], options["html"])
    with errors_for_machines(options["json"]):
        from fitting.study.several_models import models_of_request
        from fitting.study.simulation_orders import band_of_request, simulate_request

        told = simulate_request(Path(options["out"]), options)
        several = models_of_request(told, options)
        band = band_of_request(told, options)
    shown = [
        line("WRITTEN", f"{told.file} and muscle.toml beside it: {counted(told.samples, 'sample')}"),
        *lines("BAND", simulated_band_texts(band)),
        *lines("MODELS", several_models_texts(several)),
        *lines("WARNING", told.warnings),
        line("NEXT", f"mckibben compare {shell_words([options['out']])} --model {shell_words([options['model']])}"),
    ]
    result = {"file": str(told.file), "samples": told.samples, "warnings": list(told.warnings)}
    result |= {"band": simulated_band_result(band), "models": several_models_result(several)}
    output(options, "mckibben simulate", shown, result)
