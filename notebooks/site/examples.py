"""The worked example of each effect's page: hide it in a simulated recording, compare, add it, watch the error fall.

`python notebooks/site/examples.py` runs the commands of all examples and writes what they printed to examples.json, from
which the pages are made. It takes some five minutes, so the answers are kept with the program; names of effects after it
do those again.
"""

import contextlib
import json
import re
import shlex
import sys
import tempfile
from collections.abc import Collection
from pathlib import Path
from typing import Any

from click.testing import CliRunner

from fitting import showing
from fitting.report.pictures.effect import SIZES, Trace, hosts_of, trace
from fitting.study.baseline import BASELINE
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.effects import LIBRARY, SUPPLIES, KineticFriction
from mckibben_jax.muscle import quantities
from mckibben_jax.parameter import parameters

KEPT = Path(__file__).with_name("examples.json")
MUSCLE = ("length", "radius", "braid_angle", "wall_thickness", "shear_modulus")
PRESSURES = '--pressures "1 bar, 3 bar, 5 bar"'
TURNS = "--turns 0,0.26,0.1,0.2,0"
TESTS = {  # what `simulate` is told to record, by how the picture of the effect calls the test that shows it
    "a loop at 3 bar and 10": f"--test loop {PRESSURES} {TURNS} --speed '10 mm/s'",
    "a loop at 3 bar and 300": f"--test loop {PRESSURES} {TURNS} --speed '300 mm/s' --rate '1 kHz'",
    "an isometric": '--test isometric --pressure "0.2 bar, 5 bar" --contraction 0,0.1,0.2',
    "a jump": '--test isometric --pressure "1 bar, 4 bar" --contraction 0,0.1,0.2 --duration 0.2s --rate "1 kHz"',
}
SAID = re.compile(r"^RESULT +(.+?)(?=^ *$|^[A-Z]{2,})", re.DOTALL | re.MULTILINE)


def model_file(kind: type[Effect], found: Trace) -> str:
    """The model.toml of a muscle that has the effect, beside gas and dry friction."""
    sizes = [*MUSCLE, *(need for need in kind.needs if need in quantities() and need not in MUSCLE)]
    told = ["[muscle]"]
    told += [f'{name} = "{showing.show(float(SIZES[name]), quantities()[name][0])}"' for name in sizes]
    others = [*hosts_of(kind), *(each for each in BASELINE if each.family != kind.family)]
    for name in dict.fromkeys(map(name_of, others)):
        told += ["", "[[effect]]", f'name = "{name}"']
    told += ["", "[[effect]]", f'name = "{name_of(kind)}"']
    for p in parameters(kind):
        told.append(f'{p.name} = "{showing.show(float(getattr(found.effect, p.name)), p.unit)}"')
    return "\n".join(told) + "\n"


def commands(kind: type[Effect], found: Trace) -> list[str]:
    """What one types."""
    options = [next(words for begin, words in TESTS.items() if found.test.startswith(begin))]
    if kind is KineticFriction:  # one speed alone would pass for another coefficient of friction
        options = [words for begin, words in TESTS.items() if begin.startswith("a loop")]
    folders = ["practice"] if len(options) == 1 else ["slow", "fast"]
    added = [name_of(each) for each in hosts_of(kind) if each not in BASELINE]
    recorded = zip(options, folders, strict=True)
    return [
        *(f'mckibben simulate model.toml {how} --noise "0.5 N" --out {folder}' for how, folder in recorded),
        f"mckibben compare {' '.join(folders)}",
        f"mckibben add {' '.join((*folders, *added, name_of(kind)))}",
    ]


def said(command: str) -> str:
    """What a command printed of its result; raises RuntimeError where it failed."""
    from fitting.cli.main import main

    done = CliRunner().invoke(main, shlex.split(command.removeprefix("mckibben ")))
    if done.exit_code:
        raise RuntimeError(f"{command}: {done.output}")
    found = SAID.search(done.stdout)
    return "" if found is None else " ".join(found[1].split())


def example(kind: type[Effect]) -> dict[str, Any] | None:
    """The model file, the commands and what each says, run in an empty folder; None where there is nothing to see."""
    found = trace(kind) if kind not in BASELINE else None
    if found is None:
        return None
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        model = model_file(kind, found)
        Path("model.toml").write_text(model, encoding="utf-8")
        return {"model": model, "said": [(command, said(command)) for command in commands(kind, found)]}


def main(names: Collection[str]) -> None:
    """Run the examples of these effects, or of all, and keep what they say beside what was kept of others."""
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if names else {}
    for kind in (*LIBRARY, *SUPPLIES):
        if not names or name_of(kind) in names:
            kept[name_of(kind)] = example(kind)
            print(name_of(kind), kept[name_of(kind)], flush=True)
    KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
