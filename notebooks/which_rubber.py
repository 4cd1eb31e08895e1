import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium")

with app.setup(hide_code=True):
    import dataclasses

    import equinox as eqx
    import jax.numpy as jnp
    import marimo as mo
    import matplotlib.pyplot as plt
    import numpy as np
    from scipy import stats

    from fitting import Fit, example_data, read_experiment, use_64_bit
    from fitting.least_squares.fit import fit_problem
    from fitting.least_squares.held_out import difference
    from fitting.problem.residuals import problem
    from fitting.problem.unknowns import unknowns
    from fitting.report import BLUE, GREEN, GREY, ORANGE, VERMILION
    from mckibben_jax import (
        BladderAxialPrinted,
        BladderMooneyRivlin,
        BladderOgden,
        BladderThinMooneyRivlin,
        IdealCylinder,
        State,
        model,
    )

    use_64_bit()

    AXIAL, THIN_T, THICK_T = "the printed axial law 28", "thin Treloar", "thick Treloar"
    THIN_MR, THICK_MR = "thin Mooney-Rivlin", "thick Mooney-Rivlin"
    OGDEN = "thick Ogden"
    THIN, THICK = "bladder_thin_mooney_rivlin", "bladder_mooney_rivlin"
    LAWS = {  # what varies in each, and where the search begins (Pa); Treloar is Mooney-Rivlin with C01 = 0
        AXIAL: {"bladder_axial_printed.G": 1e6},
        THIN_T: {f"{THIN}.C10": 2e5},
        THICK_T: {f"{THICK}.C10": 2e5},
        THIN_MR: {f"{THIN}.C10": 2e5, f"{THIN}.C01": 2e4},
        THICK_MR: {f"{THICK}.C10": 2e5, f"{THICK}.C01": 2e4},
        OGDEN: {"bladder_ogden.G": 5e5, "bladder_ogden.n": -2.0},
    }
    LIGHT = 1e6  # standard deviations of a reading that is left out
    TRUE = {"C10": 0.40e6, "C01": 0.04e6}  # Pa, rubber of the map that is made here


@app.cell
def _(answer):
    if not mo.running_in_notebook():
        print(answer)
    mo.md(f"# Which rubber: Treloar or Mooney-Rivlin, thin or thick?\n\n{answer}")
    return


@app.cell
def _(gains, judged, maps):
    answer = sentence(maps, judged, gains)
    for richer, plainer in ((THICK_MR, THICK_T), (THIN_MR, THIN_T)):  # the plainer law is a case of the richer one
        assert np.all(judged[richer].error < judged[plainer].error + 1e-3)
    assert all(judged[law].fit.converged for law in LAWS if law != AXIAL)
    return (answer,)


@app.cell
def _():
    mo.md("""
    ## Three maps

    Force over contraction and pressure of two Festo muscles (Martens & Boblan 2017), and a map *made* at the points of
    the second from a thick Mooney-Rivlin wall, with errors of 0.5 % of full scale, to see what such a map can tell.
    Radius, braid angle, length and wall vary within what is stated of them; the gas fills an ideal cylinder.
    """)
    return


@app.cell
def _():
    measured = [read_experiment(example_data(f"martens2017_{name}")) for name in ("dmsp10", "dmsp20")]
    maps = [*measured, twin(measured[1], (IdealCylinder(), BladderMooneyRivlin(**TRUE)), share=0.005)]
    return (maps,)


@app.cell
def _(maps):
    thin, thick = BladderThinMooneyRivlin(C10=0.0, C01=0.0), BladderMooneyRivlin(C10=0.0, C01=0.0)
    others = BladderAxialPrinted(G=0.0), BladderOgden(G=0.0)  # a rubber without stiffness is not there
    rivals = (IdealCylinder(), thin, thick, *others)
    judge = Judge(maps, rivals, LAWS)
    judged = {law: judge(start) for law, start in LAWS.items()}
    gains = {
        "Mooney-Rivlin": gain(judged[THICK_T], judged[THICK_MR]),
        "thick": gain(judged[THIN_MR], judged[THICK_MR]),
        "Ogden": gain(judged[THICK_MR], judged[OGDEN]),
    }
    return gains, judged


@app.cell
def _(judged, maps):
    mo.md(table(maps, judged))
    return


@app.cell
def _(judged, maps):
    by_contraction(maps, judged, {THICK_T: BLUE, THICK_MR: GREEN, OGDEN: ORANGE, AXIAL: VERMILION})
    return


@app.cell
def _(judged, maps):
    forces(maps[1], 1, judged, {AXIAL: VERMILION, THICK_T: BLUE, THICK_MR: GREEN, OGDEN: ORANGE})
    return


@app.cell
def _():
    mo.md("""
    ## How it is done

    One problem holds every rival; what is not asked for has no stiffness. A law is fitted to a whole map, and again
    without each contraction in turn, to see how well it predicts what it has not seen. A gain is believed when it
    exceeds its own error (over the contractions, of which there are only four or five) by the factor of Student's t.
    """)
    return


@app.function
def twin(experiment, effects, share, seed=0):
    """The map that a muscle with these effects would give at the same points, with errors of a share of full scale."""
    recording = experiment.recordings[0]
    contraction, pressure, time = (
        jnp.asarray(np.concatenate([getattr(run, name) for run in recording.runs]))
        for name in ("contraction", "pressure", "time")
    )
    zero = jnp.zeros_like(time)
    states = State(contraction, pressure, zero, zero, zero, zero, time)
    force = np.array(eqx.filter_jit(lambda m, s: m.force(s))(model(experiment.muscle, *effects), states))
    noise = share * float(force.max())
    force = force + np.random.default_rng(seed).normal(0, noise, len(force))
    parts = np.split(force, np.cumsum([len(run) for run in recording.runs])[:-1])
    runs = tuple(dataclasses.replace(run, measured=part) for run, part in zip(recording.runs, parts, strict=True))
    made = dataclasses.replace(recording, runs=runs, noise=noise)
    return dataclasses.replace(experiment, name="made", recordings=(made,))


@app.class_definition
@dataclasses.dataclass(frozen=True)
class Judged:
    """One law on every map: errors in % of full scale, of the fit and of contractions left out of it."""

    fit: Fit
    level: np.ndarray  # which contraction of its map a point belongs to
    rows: np.ndarray
    unseen: np.ndarray

    def of(self, number):
        """Which points belong to a map."""
        return self.fit.samples.dataset == number

    @property
    def error(self):
        """Root mean square of the fit on each map."""
        return self._by_map(self.rows)

    @property
    def predicted(self):
        """Root mean square at contractions left out, on each map."""
        return self._by_map(self.unseen)

    @property
    def at_rest(self):
        """Root mean square at rest length when it was left out, on each map."""
        return self._by_map(np.where(self.level == 0, self.unseen, np.nan))

    @property
    def missed(self):
        """The furthest that a map's geometry had to go from what is stated, in standard deviations."""
        entries = [e for e in self.fit.layout.entries if e.prior is not None]
        away = {e.name: abs(self.fit.values[e.name] - e.prior[0]) / e.prior[1] for e in entries}
        maps = dict.fromkeys(name.split("@")[1] for name in away)
        return [max(v for name, v in away.items() if name.endswith(f"@{one}")) for one in maps]

    def _by_map(self, rows):
        maps = range(len(self.fit.layout.templates))
        return np.array([np.sqrt(np.nanmean(rows[self.of(number)] ** 2)) for number in maps])


@app.class_definition
class Judge:
    """Fits laws to maps, each with its own geometry and parameters, and again without each contraction in turn."""

    def __init__(self, maps, effects, laws):
        own = sorted({name for start in laws.values() for name in start})
        self.maps, self.layout = maps, unknowns(maps, effects, own)
        self.given, self.samples = problem(maps, self.layout)
        first = np.array([self.samples.run[self.samples.dataset == k].min() for k in range(len(maps))])
        self.level = self.samples.run - first[self.samples.dataset]
        full = [max(np.max(np.abs(run.measured)) for run in one.recordings[0].runs) for one in maps]
        self.percent = np.array(full)[self.samples.dataset] / 100

    def __call__(self, start):
        """One law, by the names that vary in it and where the search begins."""
        begin = {f"{name}@{one.name}": value for name, value in start.items() for one in self.maps}
        at = self.layout.start.copy()
        at[self.layout.at(begin)] = list(begin.values())
        free = [e.name for e in self.layout.entries if e.prior is not None or e.name in begin]
        whole = fit_problem(self.layout, self.without(-1), self.samples, at, free, starts=4)
        unseen = np.zeros(len(self.samples))
        for level in range(self.level.max() + 1):
            out = fit_problem(self.layout, self.without(level), self.samples, whole.vector, free, starts=4)
            unseen = np.where(self.level == level, out.residual * LIGHT / self.percent, unseen)
        return Judged(whole, self.level, whole.residual / self.percent, unseen)

    def without(self, level):
        """The problem in which one contraction of every map weighs nothing."""
        return self.given.without(self.level == level)


@app.function
def gain(plainer, richer):
    """For each map: by how many times its own error the left-out error falls, and how many would be needed."""
    found = []
    for number in range(len(plainer.error)):
        mine = plainer.of(number)
        fall, error = difference(plainer.unseen[mine], richer.unseen[mine], plainer.level[mine])
        levels = len(np.unique(plainer.level[mine]))
        found.append((fall / error, float(stats.t.ppf(0.975, levels - 1))))
    return found


@app.function
def verdict(gains, names):
    """In words: on which maps a gain can be told."""
    told = [name for (ratio, needed), name in zip(gains, names, strict=True) if ratio > needed]
    ratios = " and ".join(f"{ratio:.1f}" for ratio, _ in gains)
    needs = " and ".join(f"{needed:.1f}" for _, needed in gains)
    words = f"told on the {' and the '.join(told)}" if told else "**not** beyond what these maps can tell"
    return f"{ratios} times its own error where {needs} are needed: {words}"


@app.function
def sentence(maps, judged, gains):
    """The answer: every number, and every verdict, out of the results."""
    names = [one.name for one in maps[:-1]]  # the last map is made, not measured
    errors = {law: " and ".join(f"{error:.2f}" for error in one.error[:-1]) for law, one in judged.items()}
    best = min(judged, key=lambda law: float(np.sum(judged[law].error[:-1])))
    fit, ogden = judged[THICK_MR].fit, judged[OGDEN].fit
    of_ogden = {c: " and ".join(f"{ogden.values[f'bladder_ogden.{c}@{name}'] * scale:.2g}" for name in names)
                for c, scale in (("G", 1e-6), ("n", 1.0))}  # fmt: skip
    mega = {c: [fit.values[f"{THICK}.{c}@{one.name}"] / 1e6 for one in maps] for c in TRUE}
    loose = {c: fit.error(f"{THICK}.{c}@made", robust=False) / 1e6 for c in TRUE}
    read = {c: " and ".join(f"{x:.2f}" for x in mega[c][:-1]) for c in TRUE}
    back = " and ".join(f"{mega[c][-1]:.2f} +/- {loose[c]:.2f}" for c in TRUE)
    walls = [f"{1e3 * judged[AXIAL].fit.values[f'muscle.wall_thickness@{name}']:.1f}" for name in names]
    rest = {law: " and ".join(f"{x:.0f}" for x in judged[law].at_rest[:-1]) for law in (AXIAL, THICK_T)}
    return f"""
On the {" and the ".join(names)}, **{best}** fits best: {errors[best]} % of full scale, against {errors[THICK_T]} % for
{THICK_T}, {errors[THIN_MR]} % for {THIN_MR}, {errors[THICK_MR]} % for {THICK_MR} and {errors[AXIAL]} % for {AXIAL}.

- From Treloar to Mooney-Rivlin the error at contractions left out falls by
  {verdict(gains["Mooney-Rivlin"][:-1], names)};
  from thin to thick by {verdict(gains["thick"][:-1], names)};
  from Mooney-Rivlin to Ogden by {verdict(gains["Ogden"][:-1], names)}.
- The printed axial law fits only with a wall of {" and ".join(walls)} mm (1.8 +/- 0.2 is stated), and misses a force
  at rest length that it has not seen by {rest[AXIAL]} % of full scale; Treloar by its energy, by {rest[THICK_T]} %.
- The constants of Mooney-Rivlin are C10 = {read["C10"]} and C01 = {read["C01"]} MPa. No rubber is like that (its C01 is
  about a tenth of C10): this wall resists the first percents of contraction and then hardly more, and C01 alone comes
  nearest to it. Ogden's one term follows it, with G = {of_ogden["G"]} MPa and n = {of_ogden["n"]}: one rubber in two
  hoses of one make. On the made map {TRUE["C10"] / 1e6:.2f} and {TRUE["C01"] / 1e6:.2f} MPa are read back as {back}.
- How these points were approached is not stated. Friction that does not depend on pressure may have a part in the wall.
"""


@app.function
def table(maps, judged):
    """Errors of every law on every map."""
    heads = "".join(f"{one.name}: fit | left out | geometry missed by |" for one in maps)
    lines = [f"| error, % of full scale | {heads}", "|---" * (1 + 3 * len(maps)) + "|"]
    for law, one in judged.items():
        cells = zip(one.error, one.predicted, one.missed, strict=True)
        lines.append(f"| {law} | " + " ".join(f"{a:.2f} | {b:.2f} | {c:.1f} sd |" for a, b, c in cells))
    return "\n".join(lines)


@app.function
def by_contraction(maps, judged, colours):
    """Where each law fails: by contraction, fitted and left out."""
    figure, panels = plt.subplots(1, len(maps), figsize=(10, 3.2), sharey=True, layout="constrained")
    for number, (axes, one) in enumerate(zip(panels, maps, strict=True)):
        at = [float(np.mean(run.contraction)) for run in one.recordings[0].runs]
        for law, colour in colours.items():
            result, mine = judged[law], judged[law].of(number)
            for rows, style, words in ((result.rows, "-o", law), (result.unseen, ":", "_")):
                each = [np.sqrt(np.mean(rows[mine & (result.level == k)] ** 2)) for k in range(len(at))]
                axes.semilogy(at, each, style, color=colour, markersize=4, label=words)
        axes.set(title=one.name, xlabel="contraction")
    panels[0].set_ylabel("rms error [% of full scale]")
    panels[0].plot([], [], ":", color=GREY, label="at a contraction left out")
    panels[0].legend(fontsize=7)
    return figure


@app.function
def forces(one, number, judged, colours):
    """Measured force and that of the fitted laws."""
    figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
    for k, run in enumerate(one.recordings[0].runs):
        bar = run.pressure / 1e5
        axes.plot(bar, run.measured, "o", color=GREY, label="_" * k + "measured")
        axes.annotate(
            f"{np.mean(run.contraction):.2f}", (bar[-1], run.measured[-1]), (6, -3), textcoords="offset points"
        )
        for law, colour in colours.items():
            mine = judged[law].of(number) & (judged[law].level == k)
            samples, residual = judged[law].fit.samples.where(mine), judged[law].fit.residual[mine]
            axes.plot(samples.pressure / 1e5, samples.measured + residual, color=colour, label="_" * k + law)
    axes.set(xlabel="pressure [bar]", ylabel="force [N]", title=f"{one.name}; numbers: contraction")
    axes.legend(fontsize=8)
    return figure


if __name__ == "__main__":
    app.run()
