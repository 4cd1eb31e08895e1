"""The options of commands, made from the fields of `Request`, and lists of names. Loads nothing heavy."""

import os
from collections.abc import Callable, Collection
from dataclasses import Field, fields
from pathlib import Path
from typing import Any

import click

from fitting.study.request import (
    CANDIDATES,
    DATA,
    MODEL,
    OUTPUT,
    SAVE,
    SEARCH,
    SHOOTING,
    Request,
    names_of,
    option_of,
)

Decorator = Callable[[Callable], Callable]


class NamesOption(click.Option):
    """An option that takes every name that follows it: `--effects ideal_cylinder tip`."""


class Command(click.Command):
    """A command whose list options take every name that follows.

    The list ends at the next option, and at the first name that is a file or folder: that is data.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Repeat the option before each of its names, as click wants it."""
        lists = {flag for option in self.params if isinstance(option, NamesOption) for flag in option.opts}
        return super().parse_args(ctx, _spread(args, lists))


def _spread(args: list[str], lists: Collection[str]) -> list[str]:
    spread: list[str] = []
    current, given = None, 0
    for arg in args:
        if arg.startswith("-"):
            current, given = (arg, 0) if arg in lists else (None, 0)
            spread.append(arg)
        elif current is not None and given and not _is_path(arg):
            spread += [current, arg]
            given += 1
        else:
            current = current if current is not None and not given else None
            given += current is not None
            spread.append(arg)
    return spread


def _is_path(text: str) -> bool:
    return os.sep in text or Path(text).exists()


def bundle(*options: Callable) -> Decorator:
    """Several options as one decorator, in their order."""

    def decorate(function: Callable) -> Callable:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


def request_options(*names: str) -> Decorator:
    """The options of these fields of a request as one decorator."""
    return bundle(*(_click_option(each) for each in fields(Request) if each.name in names))


def _click_option(each: Field) -> Decorator:
    option, default = option_of(each), each.default
    more: dict[str, Any] = {"help": option.help, "metavar": option.metavar}
    if option.metavar is None:
        more["is_flag"] = True
    elif isinstance(default, int):
        more |= {"type": click.IntRange(option.least, option.most), "default": default, "show_default": True}
    elif isinstance(default, tuple):
        more |= {"multiple": True, "cls": NamesOption if option.is_list else None}
    return click.option(option.flag, each.name, **more)


data_argument = click.argument("data", nargs=-1, required=True, metavar="DATASET...")
study_options = request_options(*names_of(MODEL, DATA))
candidate_options = request_options(*names_of(CANDIDATES))
fit_options = request_options(*names_of(SEARCH))
shooting_option = request_options(*names_of(SHOOTING))
save_options = request_options(*names_of(SAVE))
output_options = request_options(*names_of(OUTPUT))
effect_file_option = request_options("effect_file")
fitted_data_options = bundle(
    click.option(
        "--data",
        multiple=True,
        metavar="FOLDER",
        help="The data that the model was fitted to, once for each data set; default: the model file's folder.",
    ),
    click.option(
        "--of", metavar="NAME", help="The data set whose muscle is meant, where there are several; default: the first."
    ),
)
