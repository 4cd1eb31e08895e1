"""`mckibben library`: muscles that were identified, the shipped ones and a user's own."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fitting.cli.options import Command, output_options, request_options
from fitting.cli.run import errors_for_machines
from fitting.cli.waiting import progress_bar
from fitting.errors import InputError

if TYPE_CHECKING:
    from fitting.identified.record import Identified

ACTIONS = ("show", "add", "compare")


@click.command("library", cls=Command)
@click.argument("action", default="list", metavar="[show|add|compare]")
@click.argument("names", nargs=-1, metavar="[NAME or FOLDER]...")
@request_options("model", "effect_file")
@click.option("--name", metavar="NAME", help="add: what the muscle is called; default: the data set's folder.")
@click.option("--to", "place", metavar="FOLDER", help="add: where its folder goes; default: your own library.")
@output_options
def command(action: str, names: tuple[str, ...], name: str | None, place: str | None, **options: Any) -> None:
    """List the muscles that were identified; show one, add yours, compare yours with them.

    add FOLDER: a data set with its model.toml becomes a folder that can be sent to others: data, model, posterior,
    verdict, source. compare FOLDER [NAME]...: how your muscle differs from those named, or from all.
    """
    from fitting.cli.output import output
    from fitting.compiled.prepare import prepare

    prepare()
    with errors_for_machines(options["json"]):
        shown, result = _ACTIONS[_checked(action, names)](names, options | {"name": name, "place": place})
    output(options, "mckibben library", shown, result)


def _checked(action: str, names: tuple[str, ...]) -> str:
    from fitting.errors import unknown_name

    if action not in ("list", *ACTIONS):
        raise unknown_name("action", action, ACTIONS)
    if action != "list" and not names:
        raise InputError(f"'library {action}' needs a name or a folder", cure=f"mckibben library {action} NAME")
    return action


def _list(_: tuple[str, ...], __: dict[str, Any]) -> tuple[list, dict]:
    from fitting.identified.shelf import own_folder, shelf
    from fitting.report.text.identified import shelf_report, shelf_result
    from fitting.report.text.layout import lines

    unread: list[InputError] = []
    found = shelf(unread.append)
    warned = lines("WARNING", map(str, unread), "yellow")
    return [*shelf_report(found, str(own_folder())), *warned], shelf_result(found)


def _show(names: tuple[str, ...], _: dict[str, Any]) -> tuple[list, dict]:
    from fitting.identified.shelf import named
    from fitting.report.text.identified import muscle_report, shelf_result

    found = [named(name) for name in names]
    return [part for each in found for part in muscle_report(each)], shelf_result(found)


def _add(names: tuple[str, ...], options: dict[str, Any]) -> tuple[list, dict]:
    from fitting.identified.shelf import Shelved, check_name, own_folder, put
    from fitting.report.text.identified import shelf_result
    from fitting.report.text.layout import line, lines

    if len(names) != 1:
        raise InputError("one muscle is added at a time", value=" ".join(names), cure="name one folder")
    place = Path(options["place"]) if options["place"] else own_folder()
    check_name(options["name"] or Path(names[0]).resolve().name, place)  # before all that takes its time
    made, experiment, model = _identified(names[0], options["name"], options)
    folder = put(made, experiment, model, place)
    missing = [key for key in ("citation", "licence") if not made.source.get(key)]
    warned = [f"muscle.toml names no {' and no '.join(missing)}: others cannot know whom to thank, or what they may do"]
    shown = [line("ADDED", f"{made.name}: {folder}"), *lines("WARNING", warned if missing else [], "yellow")]
    return [*shown, line("NEXT", f"mckibben library show {made.name}")], shelf_result([Shelved(folder, False, made)])


def _compare(names: tuple[str, ...], options: dict[str, Any]) -> tuple[list, dict]:
    from fitting.identified.record import FILE
    from fitting.identified.shelf import named, shelf
    from fitting.report.text.identified import comparison_of_muscles, differences_result

    first, *rest = names
    known = (Path(first) / FILE).is_file() or not Path(first).exists()
    mine = named(first).muscle if known else _identified(first, None, options)[0]
    others = [named(name).muscle for name in rest] or [e.muscle for e in shelf() if e.muscle.sha256 != mine.sha256]
    return comparison_of_muscles(mine, others), differences_result(mine, others)


def _identified(path: str, name: str | None, options: dict[str, Any]) -> "tuple[Identified, Any, Path]":
    """The muscle of a data set with the model that was fitted to it, and the file of that model."""
    from fitting.identified.identify import identified
    from fitting.library.library import library
    from fitting.model_files.model_file import read_model
    from fitting.problem.estimate import ParameterState
    from fitting.study.request import Request
    from fitting.study.task import task_of

    request = Request.of(options | {"data": (path,)})
    model = Path(request.model_file)
    if not model.is_file():
        raise InputError("there is no model of the muscle", model, cure=f"'mckibben discover {path}' writes one")
    stored = read_model(model, library(request.effect_file))
    held = tuple(name for name, state in stored.states.items() if state is ParameterState.FIXED)
    task = task_of(request)
    task = replace(task, varying=task.varying.fixing(*(name for name in held if name in task.layout.names)))
    if not stored.fitted_to(task.experiments):
        cure = f"'mckibben fit {path}' fits it again"
        raise InputError("the model was not fitted to these data as they are now", model, cure=cure)
    with progress_bar("identifying", options["quiet"]) as progress:
        made = identified(task, name or task.experiments[0].folder.resolve().name, progress)
    return made, task.experiments[0], model


_ACTIONS = {"list": _list, "show": _show, "add": _add, "compare": _compare}
