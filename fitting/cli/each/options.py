"""`--each` and `--scheduler`: many data sets, each fitted or diagnosed on its own, here or on a cluster."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fitting.cli.options import bundle
from fitting.cli.run import NOT_CONVERGED, check_results, errors_for_machines, progress_bar
from fitting.compiled.prepare import prepare
from fitting.errors import InputError
from fitting.showing import spoken
from fitting.study.request import Request

if TYPE_CHECKING:
    from rich.console import RenderableType

    from fitting.cli.each.run import All

each_options = bundle(
    click.option("--each", is_flag=True, help="Each data set on its own; 'line/*' in quotes means all in there."),
    click.option("--scheduler", metavar="ADDRESS", help="The same on the workers of this Dask scheduler."),
    click.option("--out", metavar="FOLDER", help="Where the results of --each go; default: ./each_COMMAND."),
)


def wants_each(options: dict[str, Any]) -> bool:
    """Whether each data set is to be looked at on its own; what only then has a meaning is refused without it."""
    wanted = options["each"] or options["scheduler"] is not None
    if options["out"] and not wanted:
        raise InputError("--out is where the results of --each go", value=options["out"], cure="add --each")
    return wanted


def run_each(options: dict[str, Any], command: str) -> None:
    """Do a command with every data set on its own."""
    prepare()
    request = Request.of(options)
    check_results(request.json, request.html)
    from fitting.cli.each.run import each, on
    from fitting.cli.each.work import Order
    from fitting.cli.output import output
    from fitting.study.data_sets import data_sets
    from fitting.version import command_line

    with errors_for_machines(request.json):
        _refuse(options)
        meant = data_sets(request.data, single=request.test is not None)
        order = Order(
            command, request.candidates, request.rivals, _code(request), command_line(), request.through_instruments
        )
        work = None if options["scheduler"] is None else on(options["scheduler"])
        place = Path(options["out"] or f"each_{command}")
        with progress_bar("reading", request.quiet) as progress:
            found = each(meant.sets, request, order, place, work, progress)
    with spoken(found.units):
        shown, title = _shown(found, meant.passed_by), f"{len(found.sets)} data sets, each on its own"
        output(options, title, shown, _result(found))
    sys.exit(_status(found))


def _refuse(options: dict[str, Any]) -> None:
    """What has no meaning for many data sets."""
    for name, why in (("save", "models go into the folder of --out"), ("propose", "it needs a study of one data set")):
        if options.get(name):
            cure = f"leave --{name} out: {why}"
            raise InputError(f"--{name} beside --each", value=options[name] if name == "save" else None, cure=cure)
    if options["scheduler"] is not None and options["effect_file"] is not None:
        cure = "write the effect as a line with --define, or leave out --scheduler"
        raise InputError("--effect-file is not sent to the workers of a scheduler", options["effect_file"], cure=cure)


def _code(request: Request) -> str:
    if not request.effect_file:
        return ""
    try:
        return Path(request.effect_file).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return ""  # whoever reads it next says so


def _shown(found: "All", passed_by: int) -> "list[RenderableType]":
    from fitting.cli.each.folder import TABLE
    from fitting.report.text.each import report
    from fitting.report.text.layout import line

    shown = report(found.sets, found.results)
    if passed_by:
        one = passed_by == 1
        said = f"{passed_by} other{'' if one else 's'} that the pattern finds {'is' if one else 'are'} no data set"
        shown.append(line("NOTE", f"{said}: without muscle.toml"))
    before = len(found.sets) - found.computed - sum("error" in result for result in found.results)
    known = f"; {before} {'was' if before == 1 else 'were'} there already" if before > 0 else ""
    return [*shown, line("WRITTEN", f"{found.place}: {TABLE}, and the files of each data set{known}")]


def _result(found: "All") -> dict[str, Any]:
    """The same for machines."""
    from fitting.report.text.each import outcome

    rows = [{"data_set": one.name, "path": one.path, "outcome": outcome(result), "result": result}
            for one, result in zip(found.sets, found.results, strict=True)]  # fmt: skip
    return {"folder": str(found.place), "computed": found.computed, "data_sets": rows}


def _status(found: "All") -> int:
    """2 where nothing could be used, 3 where something could not or did not converge."""
    if all("error" in result for result in found.results):
        return 2
    done = all("error" not in result and result.get("converged", True) for result in found.results)
    return 0 if done else NOT_CONVERGED
