"""Notebooks as pages of the site: their words, their code, and what it printed and drew when `make docs` ran them.

`marimo export ipynb --include-outputs` runs a notebook and keeps everything in one file of a public format; what is made
of it opens from disk. Formulas in LaTeX become MathML, which browsers draw by themselves.
"""

import base64
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
RUN = ROOT / "build" / "notebooks"  # where `make docs` leaves the notebooks that it has run
SAID = "mo.md("  # a cell that begins so only says what its output shows
LATEX = re.compile(r"(\$\$)(.+?)\$\$|(?<![\w$])(\$)([^$\n]+?)\$(?!\w)", re.DOTALL)


def on_files(files: Any, config: Any) -> Any:
    """Add the notebooks that were run to what is written; a hook of MkDocs."""
    from mkdocs.structure.files import File

    for place, content in worked_notebooks():
        files.append(File.generated(config, place, content=content))
    return files


def worked_notebooks(run: Path = RUN) -> Iterator[tuple[str, str | bytes]]:
    """The pages and pictures of all notebooks that were run: their places in the site, and what they hold."""
    for path in sorted(run.glob("*.ipynb")):
        yield from worked_page(path)


def worked_page(path: Path) -> Iterator[tuple[str, str | bytes]]:
    """One notebook: its pictures, then its page."""
    name, parts = path.stem, list[str]()
    for number, cell in enumerate(json.loads(path.read_text(encoding="utf-8"))["cells"]):
        source = "".join(cell["source"]).strip()
        if cell["cell_type"] == "markdown":
            parts.append(with_formulas(source))
            continue
        if source and not source.startswith(SAID):
            parts.append(f"```python\n{source}\n```")
        for at, output in enumerate(cell.get("outputs", ())):
            data = output.get("data", {})
            if "image/png" in data:
                picture = f"{name}_{number}_{at}.png"
                yield f"notebooks/{picture}", base64.b64decode("".join(data["image/png"]))
                parts.append(f"![What the code above draws]({picture})")
            else:
                parts += shown(data)
    if parts[0].startswith("```"):  # the imports stand above the title in a notebook, below it on a page
        parts[:2] = reversed(parts[:2])
    source = f"`notebooks/{name}.py`; `marimo edit notebooks/{name}.py` opens it to work in."
    yield f"notebooks/{name}.md", "\n\n".join([*parts, "---", source]) + "\n"


def shown(data: dict[str, Any]) -> list[str]:
    """An output that is no picture, as Markdown."""
    for kind in ("text/markdown", "text/html"):
        if kind in data:
            return [with_formulas("".join(data[kind]).strip())]
    return [f"```text\n{''.join(data['text/plain']).rstrip()}\n```"] if "text/plain" in data else []


def with_formulas(text: str) -> str:
    """The same with LaTeX as MathML."""
    from latex2mathml.converter import convert

    def drawn(found: re.Match) -> str:
        block = found[1] is not None
        made = convert(found[2] if block else found[4], display="block" if block else "inline")
        return f'<div class="formula">{made}</div>' if block else made

    return LATEX.sub(drawn, text)
