"""`mckibben ...`: finds the command, and turns every error of the user's into one message."""

import gc
import importlib
import importlib.util
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from typing import Any

import click

from fitting.cli.interrupts import SaidStopped, interruptible
from fitting.errors import InputError
from fitting.writing import FULL

# in the order of a study; a command whose file is not there is not offered
COMMANDS = ("demo", "init", "compare", "fit", "diagnose", "add", "drop", "discover", "plan", "posterior", "report",
            "evidence", "hill", "simulate", "selftest", "export", "library", "design", "sweep", "effects", "equations",
            "cite", "workbench", "warm")  # fmt: skip

# the command that works by the thousand, for which a GPU is worth its start; measured (an H200 beside 16 cores): 10^7
# designs in 0.37 s, but a second `diagnose` in 27 s instead of 18, and JAX claims most of a GPU's memory at once
BY_THE_THOUSAND = ("sweep",)

# new objects after which Python looks for unreachable ones (usually 700); measured: 0.6 of 3.5 CPU s of `compare` went
# into 680 such looks, nearly all while JAX was imported, and they freed a thousand objects; peak memory is the same
MANY = 50_000


class Stop(click.ClickException):
    """An error of the user's: one message, exit status 2."""

    exit_code = 2

    def show(self, file: Any = None) -> None:
        """Print the message and nothing else."""
        click.echo(f"mckibben: {self.message}", file=file or sys.stderr)


class Program(click.Group):
    """The group of all commands; each is loaded when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The commands that there are."""
        return [name for name in COMMANDS if importlib.util.find_spec(_module(name)) is not None]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of this name."""
        if cmd_name not in self.list_commands(ctx):
            return None
        if cmd_name not in BY_THE_THOUSAND:
            os.environ.setdefault("JAX_PLATFORMS", "cpu")  # before JAX is imported; what the user has set stays
        return importlib.import_module(_module(cmd_name)).command

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        """As click does, but a misspelt command gets the nearest."""
        known = self.list_commands(ctx)
        if args and args[0] not in known:
            near = get_close_matches(args[0], known, n=1)
            cure = f"Did you mean '{near[0]}'?" if near else f"There are: {', '.join(known)}."
            raise Stop(f"there is no command '{args[0]}'. {cure}")
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; what the user can cure becomes one message."""
        try:
            with interruptible(), _collecting_seldom():
                return super().invoke(ctx)
        except InputError as error:
            raise Stop(str(error)) from None
        except click.UsageError as error:
            asked = error.ctx.command_path if error.ctx else "mckibben"
            raise Stop(f"{error.format_message()} Cure: '{asked} --help' says what it takes") from None
        except RecursionError:
            raise
        except KeyboardInterrupt as stop:
            if not isinstance(stop, SaidStopped):
                click.echo("\nStopped.", err=True)
            raise click.exceptions.Exit(1) from None
        except BrokenPipeError:
            raise
        except OSError as error:
            cure = " Cure: make room, then give the same command again" if error.errno in FULL else ""
            raise Stop(f"{error.filename or 'a file'}: {error.strerror or error}.{cure}") from None


@contextmanager
def _collecting_seldom() -> Iterator[None]:
    """Look for unreachable objects seldom: what an import makes stays."""
    usual = gc.get_threshold()
    gc.set_threshold(MANY, *usual[1:])
    try:
        yield
    finally:
        gc.set_threshold(*usual)


def _module(name: str) -> str:
    return f"fitting.cli.commands.{name}"


@click.group(cls=Program, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="mckibben-jax", prog_name="mckibben")
def main() -> None:
    """Compare a McKibben muscle with its model, see where the model fails, learn which effect is missing."""
