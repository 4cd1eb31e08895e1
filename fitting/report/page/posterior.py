"""A posterior as a page that opens from disk."""

from fitting.posterior.record import LEGEND, Posterior, Quantity, inside_text, table_rows
from fitting.report.page.names import PageNames
from fitting.report.page.parts import Grid, Line, Section, render_page
from fitting.report.pictures import figures
from fitting.report.pictures.posterior import pairs, predicted
from fitting.report.results import provenance, write_text
from fitting.report.text.diagnosis import effect_set
from fitting.report.text.names import mark
from fitting.report.text.study import data_text
from fitting.study.task import Task


def write_posterior(path: str, task: Task, posterior: Posterior) -> None:
    """Write the page: what is known, how far to trust it, the pictures, where it comes from."""
    write_text(path, posterior_page(task, posterior))


def posterior_page(task: Task, posterior: Posterior) -> str:
    """The page as text."""
    verdict = "These intervals can be trusted" if posterior.trusted else "Do not take these intervals at their word"
    datasets, names = ", ".join(e.name for e in task.experiments), PageNames(task.library)
    return render_page(
        title=f"{datasets}: {verdict}",
        about=f"{data_text(task.experiments)}. Model: {names.plain(effect_set(task.names))}.",
        verdict=verdict,
        lead=[] if posterior.warnings else ["Nothing speaks against them."],
        cards=[_card(name, q) for name, q in posterior.parameters.items() if not name.startswith("muscle.")][:6],
        warnings=posterior.warnings,
        sections=[*posterior_sections(posterior), _origin(task, posterior)],
        named=names.html,
        headline=names.headline,
    )


def _card(name: str, q: Quantity) -> tuple[str, str]:
    _, median, low, high, *_ = table_rows({name: q})[1]
    return median, f"{mark(name)}: {low} to {high}"


def posterior_sections(posterior: Posterior) -> list[Section]:
    """What a page shows of a posterior: the intervals, and whether readings lie where they should."""
    heads, *rows = table_rows(posterior.parameters)
    priors = tuple(
        Line((mark(name), q.prior, f"{q.prior_sensitivity:.2f}")) for name, q in posterior.parameters.items()
    )
    words = (
        "Median and the interval that holds 90 % of the posterior. Robust: if errors that a run (where runs are few, a "
        f"loop) shares are allowed for. {LEGEND[:1].upper()}{LEGEND[1:]}.",
    )
    note = "Sensitivity: how far a sharper or wider prior would move the parameter; above 0.05 the prior has a say."
    return [
        Section(
            "How well the values are known",
            sentences=words,
            picture=figures.as_svg(pairs(posterior), "pairs"),
            caption="Dark places hold half of the draws, dark and light ones 90 %.",
            tables=(Grid(heads, tuple(Line((mark(name), *values)) for name, *values in rows)),),
            folded=(Grid(("parameter", "prior", "sensitivity"), priors, note, words=(1,)),),
            folded_title="Priors",
            rail="Posterior",
        ),
        Section(
            "Do the readings lie where they should?",
            sentences=(f"The band holds {inside_text(posterior)}.", *posterior.notes),
            picture=figures.as_svg(predicted(posterior), "bands"),
            caption="Measured minus predicted; the band should hold 90 % of the readings of each run.",
            rail="Posterior",
        ),
    ]


def _origin(task: Task, posterior: Posterior) -> Section:
    known = provenance(task)
    rows = [("command", known["command"]), ("model from", task.origin), ("sampler", posterior.method)]
    rows += [("seed", str(task.seed))]
    rows += [(f"data: {name}", f"{data['folder']}, sha256 {data['sha256']}") for name, data in known["data"].items()]
    rows += [(name, version) for name, version in known["versions"].items()]
    grid = Grid(("", ""), tuple(Line(row) for row in rows), words=(1,))
    return Section("Where this comes from", tables=(grid,), rail="Source")
