"""What every command understands: which data, which model, where the result goes. Loads nothing heavy."""

import os
from collections.abc import Callable
from pathlib import Path

import click

CHAINS = "posterior.chains"  # beside the data: what `posterior` keeps, and `report` shows
SEVERAL = ("--effects", "--fix", "--free", "--own", "--candidates")  # options that take all the names that follow them


class Command(click.Command):
    """A command whose list options take every name that follows: `--effects ideal_cylinder tip`.

    The list ends at the next option, and at the first name that is a file or folder: that is data.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Repeat the option before each of its names, as click wants it."""
        return super().parse_args(ctx, _spread(args))


def _spread(args: list[str]) -> list[str]:
    spread: list[str] = []
    current, given = None, 0
    for arg in args:
        if arg.startswith("-"):
            current, given = (arg, 0) if arg in SEVERAL else (None, 0)
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


Decorator = Callable[[Callable], Callable]


def bundle(*options: Callable) -> Decorator:
    """Several options as one decorator, in their order."""

    def decorate(function: Callable) -> Callable:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


data_argument = click.argument("data", nargs=-1, required=True, metavar="DATASET...")

data_options = bundle(
    click.option("--muscle", metavar="FILE", help="muscle.toml that belongs to a single CSV file."),
    click.option("--test", metavar="KIND", help="Kind of test of a single CSV: loop, isometric, static, ..."),
)

model_options = bundle(
    click.option("--model", metavar="FILE", help="Model file; without it the model.toml beside the data, if any."),
    click.option("--effects", multiple=True, metavar="NAME...", help="The model's effects, all of them."),
    click.option("--baseline", is_flag=True, help="Begin with the baseline, whatever model.toml says."),
    click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="Hold a parameter at this value."),
    click.option("--fix", multiple=True, metavar="NAME...", help="Parameters that do not vary."),
    click.option("--free", multiple=True, metavar="NAME...", help="Parameters that vary though taken as exact."),
    click.option("--own", multiple=True, metavar="NAME...", help="Parameters that each data set has for itself."),
    click.option("--effect-file", metavar="FILE", help="Python file with effects of your own."),
    click.option("--define", multiple=True, metavar="LINE", help="An effect: 'drag = -B*v, B = 5 N s/m (0..99)'."),
)

candidate_options = bundle(
    click.option("--candidates", multiple=True, metavar="NAME...", help="What may be missing; default: all effects."),
    click.option("--rivals", is_flag=True, help="Look at the printed rivals too."),
)

fit_options = bundle(
    click.option(
        "--starts",
        type=click.IntRange(1),
        default=8,
        show_default=True,
        metavar="N",
        help="Places that the search begins from.",
    ),
)

shooting_option = click.option(
    "--shooting", type=click.IntRange(0, 100), default=0, metavar="N",
    help="Cut recorded motions into N stretches to find where the search begins; try 8 where a fit ends far off.",
)  # fmt: skip

save_options = bundle(
    click.option("--save", metavar="FILE", help="Where the fitted model goes; default: model.toml beside the data."),
    click.option("--no-save", is_flag=True, help="Leave every model file as it is."),
)

output_options = bundle(
    click.option("--json", metavar="FILE", help="Write the result for machines, in SI units."),
    click.option("--html", metavar="FILE", help="Write the result as a page that needs no network."),
    click.option("--seed", type=click.IntRange(0), default=0, show_default=True, metavar="N",
                 help="Seed of everything random."),
    click.option("--quiet", is_flag=True, help="Print nothing but errors."),
)  # fmt: skip

study_options = bundle(data_options, model_options)
