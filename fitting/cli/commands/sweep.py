"""`mckibben sweep`: designs by the million."""

import importlib.util
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

import click

from fitting.cli.options import Command, effect_file_option, output_options
from fitting.cli.run import check_results, errors_for_machines, progress_bar
from fitting.compiled.prepare import prepare

PARQUET = "parquet"
NEEDS = {PARQUET: "pyarrow", "zarr": "zarr"}  # the formats of `sweep_files`, and the package that writes each


@click.command("sweep", cls=Command)
@click.argument("spec", metavar="SPEC.toml")
@click.option("--out", metavar="FOLDER", help="Where the files go; default: SPEC_sweep beside the file.")
@click.option("--to", "kind", default=PARQUET, show_default=True, type=click.Choice(list(NEEDS)), help="Kind of files.")
@click.option("--scheduler", metavar="ADDRESS", help="Dask scheduler whose workers share the work.")
@effect_file_option
@output_options
def command(
    spec: str, out: str | None, kind: str, scheduler: str | None, effect_file: str | None, **options: Any
) -> None:
    """Evaluate every design of a grid or sample that SPEC.toml describes; begun sweeps are gone on with."""
    _use_all_cores()
    prepare()
    check_results(options["json"], options["html"])
    from fitting.cli.output import output
    from fitting.designs.sweep import sweep
    from fitting.designs.sweep_file import read_sweep
    from fitting.library.library import library
    from fitting.report.text.sweep import describe, to_json

    with errors_for_machines(options["json"]):
        _need_writer(kind)
        order = read_sweep(spec, library(effect_file))
        work = _work(scheduler, effect_file)
        folder = Path(out) if out else Path(spec).with_name(f"{Path(spec).stem}_sweep")
        with progress_bar("compiling", options["quiet"]) as progress:
            found = sweep(order, folder, work, progress, kind=kind)
    output(options, "Sweep", [describe(found)], to_json(found))


def _need_writer(kind: str) -> None:
    from fitting.errors import InputError

    if importlib.util.find_spec(NEEDS[kind]) is None:
        cure = "pip install 'mckibben-jax[sweep]'"
        raise InputError(f"a sweep that writes {kind.capitalize()} needs {NEEDS[kind]}", cure=cure)


def _use_all_cores() -> None:
    """On processors jax sees one device however many cores there are: let it see each core. Not for GPUs."""
    import jax

    from fitting.threads import cores

    if "xla_force_host_platform_device_count" not in os.environ.get("XLA_FLAGS", ""):
        with suppress(RuntimeError):  # jax has begun already, in a process that does other things too
            jax.config.update("jax_num_cpu_devices", cores())


def _work(scheduler: str | None, effect_file: str | None) -> Any:
    if scheduler is None:
        return None
    from fitting.cli.cluster.sweeps import on
    from fitting.errors import InputError

    if effect_file is not None:
        cure = "leave out --scheduler, or install your effects as a package on the workers"
        raise InputError("--effect-file is not sent to the workers of a scheduler", effect_file, cure=cure)
    return on(scheduler)
