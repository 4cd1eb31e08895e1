"""Pages of the site that are made from the program itself when it is built: nothing in them is copied by hand.

A hook of MkDocs. Effects and equations come from their declarations, commands from their options, Python from docstrings
(by mkdocstrings), the rest from files that stand elsewhere in the project.
"""

import ast
import json
import re
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import click

from fitting import showing
from fitting.cli.main import COMMANDS, main
from fitting.report.formula import formula_html
from fitting.report.pictures.rig_drawing import rig_svg, acts_where
from fitting.report.text.catalogue import STAGES, first_sentence, meaning, symbols
from fitting.report.text.equations import STATUS, function_name
from mckibben_jax import LIBRARY, SUPPLIES, Effect, name_of, parameters
from mckibben_jax.effect import title_of
from mckibben_jax.laws.review import EQUATIONS

ROOT = Path(__file__).resolve().parents[2]
EFFECTS = (*LIBRARY, *SUPPLIES)
ESCAPED = "\\+"  # a plus that begins no list
EXAMPLES = Path(__file__).with_name("examples.json")  # written by examples.py
BORROWED = {"contributing.md": "CONTRIBUTING.md", "changes.md": "CHANGELOG.md", "data.md": "data/README.md",
            "benchmarks.md": "tests/benchmarks/README.md"}  # fmt: skip


def on_files(files: Any, config: Any) -> Any:
    """Add the generated pages to those that are written."""
    from mkdocs.structure.files import File  # the pages themselves can be made, and tested, without the generator

    for place, text in pages(drawn=True):
        files.append(File.generated(config, place, content=text))
    picture = ROOT / "notebooks" / "error_falling.svg"
    files.append(File.generated(config, "error_falling.svg", content=picture.read_text(encoding="utf-8")))
    return files


def pages(drawn: bool = False) -> Iterator[tuple[str, str]]:
    """Every generated page: its place and its Markdown; what effects leave in data is `drawn` only where that is asked.

    The drawings take half a second each: the effects are computed for them.
    """
    yield "effects/index.md", effects_page()
    for kind in EFFECTS:
        yield (
            f"effects/{name_of(kind)}.md",
            f"---\nsearch:\n  boost: 2\n---\n\n{effect_page(kind)}{fingerprint_of(kind) if drawn else ''}{example_of(kind)}",
        )
    yield "errata.md", errata_page()
    yield "commands.md", commands_page()
    yield "python.md", python_page()
    yield "notebooks.md", notebooks_page()
    for place, source in BORROWED.items():
        yield place, (ROOT / source).read_text(encoding="utf-8")


# Effects ---------------------------------------------------------------------------------------------------------------


def cell(text: str) -> str:
    """Text that may stand in a cell of a table."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def effects_page() -> str:
    """All effects by stage."""
    told = [
        "# Effects",
        f"{len(EFFECTS)} effects. A model is a set of them; an effect of your own counts like any other.",
    ]
    for stage, question in STAGES.items():
        told += [f"## {stage}: {question}", "| effect | parameters | what it is |\n|---|---|---|"]
        rows = [f"| [`{name_of(k)}`]({name_of(k)}.md) | {', '.join(f'`{p.name}`' for p in parameters(k))} | "
                f"{cell(first_sentence(meaning(k)))} |" for k in EFFECTS if k.stage == stage]  # fmt: skip
        told[-1] += "\n" + "\n".join(rows)
    return "\n\n".join(told) + "\n"


def effect_page(kind: type[Effect]) -> str:
    """One effect in full, as it declares itself."""
    told = [f"# {title_of(kind)}", f"`{name_of(kind)}`", cell(meaning(kind))]
    if kind.formula:
        told += [typeset(kind.formula, [p.name for p in parameters(kind)])]
        told += [f"*{cell('; '.join(symbols(kind)))}*"] if symbols(kind) else []
    if kind.suspect:
        told += [f"**When to suspect it:** {cell(kind.suspect)}"]
    own = parameters(kind)
    if own:
        rows = [f"| `{p.name}` | {cell(p.meaning)} | {showing.show(p.default, p.unit)} | {showing.show(p.lower, p.unit)} to "
                f"{showing.show(p.upper, p.unit)} |" for p in own]  # fmt: skip
        told += ["| parameter | meaning | unless fitted | range |\n|---|---|---|---|\n" + "\n".join(rows)]
    told += [f"{acts_where(kind)}\n\n{rig_svg(kind)}"] if kind.part else []
    told += [f"**Stage:** {kind.stage}, {STAGES[kind.stage]}"]
    if kind.family:
        rivals = [name_of(k) for k in EFFECTS if k.family == kind.family and k is not kind]
        listed = ", ".join(f"[`{name}`]({name}.md)" for name in rivals) or "none in the library"
        told += [f"**Replaces and is replaced by** (family *{kind.family}*): {listed}"]
    told += [f"**Needs:** {', '.join(kind.needs).replace('_', ' ')}"] if kind.needs else []
    told += ["**Rival:** a printed law that is unsound; a candidate only on request"] if kind.rival else []
    told += [f"**Tested:** {cell(kind.on_request)}"] if kind.on_request else []
    told += [f"**Constants in the law:** {', '.join(kind.fixed)}"] if kind.fixed else []
    told += [f"**Source:** {cell(kind.source)}"] if kind.source else []
    told += [f"```sh\nmckibben effects {name_of(kind)}\n```", f"In Python: `mckibben_jax.{kind.__name__}`"]
    return "\n\n".join(told) + "\n"


def fingerprint_of(kind: type[Effect]) -> str:
    """What an effect leaves in the test that shows it, as a drawing of its page; empty where it leaves nothing."""
    from fitting.compiled.prepare import prepare
    from fitting.report.pictures.effect import fingerprint
    from fitting.report.pictures.figures import as_svg

    prepare()
    caption, figure = fingerprint(kind)
    if figure is None:
        return ""
    drawing = as_svg(figure, f"fingerprint-{name_of(kind)}")
    return f'\n## In the data\n\nThe muscle is the same for all effects: {caption}.\n\n<div class="fingerprint">{drawing}</div>\n'


def example_of(kind: type[Effect]) -> str:
    """The worked example of an effect's page; empty where there is nothing to see."""
    kept = json.loads(EXAMPLES.read_text(encoding="utf-8")).get(name_of(kind))
    if kept is None:
        return ""
    told = [
        "## Try it",
        "The effect is hidden in a simulated recording; the first model lacks it. Save this as `model.toml`:",
        f"```toml\n{kept['model'].rstrip()}\n```",
        "Then type what follows. What each command says of its result stands below it.",
    ]
    for command, words in kept["said"]:
        lines = command.replace(" --noise", " \\\n  --noise").replace(" --turns", " \\\n  --turns")
        told += [f"```sh\n{lines}\n```", *([f"> {cell(words).replace('+', ESCAPED)}"] if words else [])]
    told += ["`mckibben diagnose` in place of `compare` looks for it among all effects."]
    return "\n" + "\n\n".join(told) + "\n"


# Equations -------------------------------------------------------------------------------------------------------------


def errata_page() -> str:
    """The review's equations with what is wrong in print, and what the program computes instead."""
    wrong = [e for e in EQUATIONS if e.status in ("misprint", "questionable")]
    told = [
        "# Equations of Tondu 2012, and errata",
        f"The program reproduces {len(EQUATIONS)} equations of the review and of its sources. {len(wrong)} of them are "
        "misprinted or questionable; those that differ from print keep the printed form under a name of its own, so that "
        "the two can be compared. `mckibben equations 25` shows one in the terminal.",
        "| equation | quantity | in print |\n|---|---|---|\n"
        + "\n".join(
            f"| [{e.number}](#{anchor(e.number)}) | {cell(e.quantity)} | {STATUS[e.status]} |" for e in EQUATIONS
        ),
    ]
    for e in EQUATIONS:
        told += [
            f"## {e.number}: {cell(e.quantity)} {{ #{anchor(e.number)} }}",
            typeset(e.formula) + (" (as printed)" if e.formula_printed else ""),
            f"*{cell(e.symbols)}*",
        ]
        told += [f"**In print: {STATUS[e.status] or 'correct'}.** {cell(e.correction)}"]
        told += [
            f"Call `{function_name(e.function)}`" + (f"; as printed `{function_name(e.printed)}`" if e.printed else "")
        ]
    return "\n\n".join(told) + "\n"


def typeset(formula: str, names: Collection[str] = ()) -> str:
    """A formula as browsers draw it, and below it the text, which can be copied."""
    return f'<div class="formula">{formula_html(formula, names)}</div>\n\n`{formula}`'


def anchor(number: str) -> str:
    """The place of an equation on its page."""
    return "eq-" + re.sub(r"\W+", "-", number.lower())


# Commands and Python ---------------------------------------------------------------------------------------------------


def commands_page() -> str:
    """Every command with its options, as the command line declares them."""
    told = ["# Commands", "Exit status: 0 done, 2 bad input (one message, with its cure), 3 ran but did not converge."]
    for name in COMMANDS:
        command = main.get_command(click.Context(main), name)
        assert command is not None
        context = click.Context(command, info_name=f"mckibben {name}")
        told += [f"## mckibben {name}", cell(command.help or ""), f"```\n{command.get_usage(context)}\n```"]
        records = [record for p in command.params if (record := p.get_help_record(context))]
        if records:
            rows = [f"| `{cell(option)}` | {cell(words)} |" for option, words in records]
            told += ["| option | |\n|---|---|\n" + "\n".join(rows)]
    return "\n\n".join(told) + "\n"


def python_names() -> list[str]:
    """The stable names, from the test that keeps them stable."""
    tree = ast.parse((ROOT / "tests" / "test_public_api.py").read_text(encoding="utf-8"))
    table = next(n.value for n in tree.body if isinstance(n, ast.Assign) and ast.unparse(n.targets[0]) == "PYTHON")
    return list(ast.literal_eval(table))


def python_page() -> str:
    """The stable names with their docstrings."""
    told = [
        "# Python",
        "Names that are kept from version to version (`tests/test_public_api.py`). Everything is in SI units.",
    ]
    package = ""
    for name in python_names():
        if name.split(".")[0] != package:
            package = name.split(".")[0]
            told += [f"## {package}"]
        told += [entry(name)]
    return "\n\n".join(told) + "\n"


def entry(name: str) -> str:
    """The place of a name's docstring: a function that a module is named after stands in that module."""
    if not (ROOT / f"{name.replace('.', '/')}.py").exists():
        return f"::: {name}"
    return f"::: {name}.{name.split('.')[-1]}\n    options:\n      heading: {name}\n      toc_label: {name}"


# Notebooks -------------------------------------------------------------------------------------------------------------


def notebooks_page() -> str:
    """The notebooks by name, each with its title and first words."""
    told = [
        "# Notebooks",
        "They lie in `notebooks/` and are plain Python files: `marimo edit notebooks/1_five_minutes.py` opens one to work "
        "in, `python notebooks/1_five_minutes.py` prints its answer. Those with a number are for people who start, in this "
        "order; the others are studies of questions that the review left open.",
    ]
    for path in sorted((ROOT / "notebooks").glob("*.py")):
        title, words = first_words(path)
        if title:
            was_run = (ROOT / "build" / "notebooks" / f"{path.stem}.ipynb").exists()  # `worked` makes its page
            page = f": [read it with its results](notebooks/{path.stem}.md)" if was_run else ""
            told += [f"## {title}", words, f"`notebooks/{path.name}`{page}"]
    return "\n\n".join(told) + "\n"


def first_words(path: Path) -> tuple[str, str]:
    """Title and first paragraph of a notebook, from its first cell with a heading; empty for what has none."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            found = re.match(r"\s*# (.+?)\n\s*\n(.*?)(\n\s*\n|\Z)", node.value, re.DOTALL)
            if found:
                return found[1].strip(), " ".join(found[2].split()) if "$$" not in found[2] else ""
    return "", ""
