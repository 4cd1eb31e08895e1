"""`mckibben export`: the model for somebody else's simulator or controller."""

from typing import Any

import click

from fitting.cli.options import Command, effect_file_option, fitted_data_options, output_options
from fitting.cli.run import errors_for_machines


@click.command("export", cls=Command)
@click.argument("model")
@click.option(
    "--to",
    "form",
    required=True,
    type=click.Choice(["python", "c", "mujoco", "fmu", "table", "simulink", "arduino"]),
    help="python: a module of plain numpy. c: a header of C99. mujoco: a folder with callbacks and scenes. "
    "fmu: FMI 2.0, co-simulation. table: force over contraction and pressure, on both branches. "
    "simulink: an S-function in C. arduino: a sketch that prints the force.",
)
@click.option(
    "--out",
    metavar="FILE",
    help="Where it goes; default muscle.py, .h, .fmu, .csv; folders: muscle_mujoco, muscle_simulink, muscle_arduino. "
    "A table may be .parquet.",
)
@click.option("--contraction", metavar="LIST", help="Table: from, to; default 0 to where the force vanishes.")
@click.option("--pressure", default="0 bar,5 bar", show_default=True, metavar="LIST", help="Table: from, to.")
@click.option("--points", default="51,11", show_default=True, metavar="N,N", help="Table: contractions, pressures.")
@click.option("--without", multiple=True, metavar="NAME", help="Leave this effect out, for example the load cell's.")
@click.option(
    "--draws",
    type=click.IntRange(1, 100_000),
    metavar="N",
    help="python, c, mujoco: so many sets of parameters that the data leave open, of which a simulation chooses.",
)
@fitted_data_options
@click.option("--muscle", metavar="FILE", help="muscle.toml, where it is not the model file's muscle.")
@effect_file_option
@output_options
def command(**options: Any) -> None:
    """Write MODEL (a model.toml) for a program that does not know this one: numpy, C, MuJoCo, Simulink, a table ...

    The module and the header have step(state, pressure, displacement, dt), force, stiffness, linearise, pressure_for
    and pressure_for_step, which takes hysteresis into account. Every form states the largest force error to expect.
    """
    from fitting.cli.output import output
    from fitting.compiled.prepare import prepare
    from fitting.report.text.bands import band_lines, bands_result
    from fitting.report.text.export import draws_text
    from fitting.report.text.layout import line, lines

    prepare()
    with errors_for_machines(options["json"]):
        from fitting.exporting.orders import export_of

        made = export_of(options)
    result: dict[str, Any] = made.result | {"bands": bands_result(made.bands), "warnings": list(made.beware)}
    shown = [line("WRITTEN", f"{made.file}: {made.words}"), line("ERROR", result["force_error"])]
    shown += lines("WARNING", made.beware)
    shown += [*lines("NEW RUN", band_lines(made.bands)), line("USE", result["use"])]
    shown += [line("DRAWS", draws_text(result["draws"], result["force_error_N"]))] if "draws" in result else []
    output(options, "mckibben export", shown, result)
