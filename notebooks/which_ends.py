import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium")

with app.setup(hide_code=True):
    import marimo as mo
    import matplotlib.pyplot as plt
    import numpy as np
    from which_rubber import Judge, gain, table, verdict

    from fitting import example_data, read_experiment, use_64_bit
    from fitting.report import BLUE, GREEN, GREY, ORANGE, SKY, VERMILION
    from mckibben_jax import BladderMooneyRivlin, ConicalEnds, ConicalEndsPrinted, IdealCylinder, ReducedLength, Tip
    from mckibben_jax.laws import braid
    from mckibben_jax.laws.ends import held_ends_factor, held_ends_reach

    use_64_bit()

    C10, C01 = {"bladder_mooney_rivlin.C10": 2e5}, {"bladder_mooney_rivlin.C01": 2e5}
    MOONEY = {**C10, **C01}
    ENDS = {
        "cones by their volume (25E)": {"conical_ends.k_c": 0.2},
        "k times the contraction": {"tip.k": 1.1},
        "reduced length": {"reduced_length.factor": 1.0},
    }
    PRINTED = {"conical_ends_printed.k_c": 0.2}
    CYLINDER, CONES, TIP, SHORT, AS_PRINTED = "cylinder", *ENDS, "cones as printed (25)"
    COLOURS = dict(zip((CYLINDER, CONES, TIP, SHORT, AS_PRINTED), (BLUE, GREEN, ORANGE, SKY, VERMILION), strict=True))
    TRELOAR = ", Treloar rubber"
    ANGLE = np.radians(20)


@app.cell
def _(answer):
    if not mo.running_in_notebook():
        print(answer)
    mo.md(f"# Which ends: cylinder, cones, a tip factor, a reduced length?\n\n{answer}")
    return


@app.cell
def _(gains, judged, maps):
    answer = sentence(maps, judged, gains)
    for ends in ENDS:  # the cylinder is a case of each of these
        assert np.all(judged[ends].error < judged[CYLINDER].error + 1e-3)
    # without any cone the printed law is not the cylinder's, and that is why it may fit worse than it
    assert no_cone_left(0.2) > 0.1
    return (answer,)


@app.cell
def _():
    mo.md("""
    ## Five kinds of ends on two maps

    The same maps as in `which_rubber.py`, with the rubber that won there, thick Mooney-Rivlin; and again with
    Treloar's, which has one constant less, so that *rubber and ends* have as many as Mooney-Rivlin's cylinder.
    """)
    return


@app.cell
def _():
    maps = [read_experiment(example_data(f"martens2017_{name}")) for name in ("dmsp10", "dmsp20")]
    return (maps,)


@app.cell
def _(maps):
    rubber = (IdealCylinder(), BladderMooneyRivlin(C10=0.0, C01=0.0))
    laws = {CYLINDER: MOONEY}
    laws |= {ends: {**MOONEY, **start} for ends, start in ENDS.items()}
    laws |= {ends + TRELOAR: {**C10, **start} for ends, start in ENDS.items()}
    judge = Judge(maps, (*rubber, ConicalEnds(k_c=0.0), Tip(k=1.0), ReducedLength(factor=0.0)), laws)
    judged = {law: judge(start) for law, start in laws.items()}
    # on its own, for it does not vanish with its cones
    printed = {**MOONEY, **PRINTED}
    judged[AS_PRINTED] = Judge(maps, (*rubber, ConicalEndsPrinted()), {AS_PRINTED: printed})(printed)
    gains = {ends: gain(judged[CYLINDER], judged[ends]) for ends in (*ENDS, AS_PRINTED)}
    return gains, judged


@app.cell
def _(judged, maps):
    mo.md(table(maps, judged))
    return


@app.cell
def _(judged, maps):
    by_contraction(maps, judged)
    return


@app.cell
def _():
    shapes()
    return


@app.cell
def _():
    mo.md("""
    Force over contraction at 20 deg, k_c = 0.5. The printed law leaves out the axial push of the pressure on the cones:
    it lies above the cylinder, where the same shape by its volume lies below. Dotted, the printed law with no cones at
    all (k_c = 0): it is not the cylinder's.
    """)
    return


@app.function
def no_cone_left(contraction, angle=ANGLE):
    """The printed law without cones minus the cylinder's, as a share of the largest force."""
    printed = braid.cone_force_printed(contraction, 1.0, 1.0, angle, 0.0)
    cylinder = braid.ideal_force(np.array([0.0, contraction]), 1.0, 1.0, angle)
    return float((printed - cylinder[1]) / cylinder[0])


@app.function
def found(judged, ends, maps):
    """The fitted parameter of these ends on each map, with its error."""
    name = next(iter({**ENDS, AS_PRINTED: PRINTED}[ends]))
    fit = judged[ends].fit
    names = [f"{name}@{one.name}" for one in maps]
    shown = [
        f"{fit.values[x]:.2f} (a bound)" if x in fit.at_bound else f"{fit.values[x]:.2f} +/- {fit.error(x):.2f}"
        for x in names
    ]
    return " and ".join(shown)


@app.function
def sentence(maps, judged, gains):
    """The answer: every number, and every verdict, out of the results."""
    names = [one.name for one in maps]
    errors = {law: " and ".join(f"{error:.2f}" for error in one.error) for law, one in judged.items()}
    sound = (CYLINDER, *ENDS)
    best = min(sound, key=lambda law: float(np.sum(judged[law].error)))
    alike = min((law for law in judged if law.endswith(TRELOAR)), key=lambda law: float(np.sum(judged[law].error)))
    both = zip(names, judged[AS_PRINTED].error, judged[CYLINDER].error, strict=True)
    worse = [name for name, printed, cylinder in both if printed > cylinder]
    printed = (
        f"worse than no ends at all on the {' and the '.join(worse)}" if worse else "better than the bare cylinder"
    )
    return f"""
On the {" and the ".join(names)}, **{best}** leaves {errors[best]} % of full scale and the
cylinder {errors[CYLINDER]} %; cones by their volume {errors[CONES]} %, a reduced length {errors[SHORT]} %, the printed
cones {errors[AS_PRINTED]} %: {printed}.

- The fits: {TIP}, k = {found(judged, TIP, maps)}; {CONES}, k_c = {found(judged, CONES, maps)}.
- {net_text(maps)}
- At contractions left out, k lowers the error of the cylinder by {verdict(gains[TIP], names)};
  cones by their volume by {verdict(gains[CONES], names)}.
- Ends or a second rubber constant? With Treloar rubber and {alike.removesuffix(TRELOAR)} the error is
  {errors[alike]} %, with Mooney-Rivlin and no ends {errors[CYLINDER]} %. Both have two constants besides the
  geometry: a map of one muscle does not say which it is.
- Without any cone (k_c = 0) the printed law 25 is still {100 * no_cone_left(0.2):.0f} % of the largest force above the
  cylinder at a contraction of 0.2 (20 deg).
"""


@app.function
def net_text(maps, contraction=0.1):
    """The factor k that a bare net has, held at the radius of its fittings; nothing is fitted."""
    made = [one.muscle for one in maps]
    factors = [held_ends_factor(contraction, m.length, m.radius, m.braid_angle) for m in made]
    reaches = [held_ends_reach(contraction, m.radius, m.braid_angle) / m.radius for m in made]
    both, far = (
        " and ".join(f"{float(value):.{digits}f}" for value in values)
        for values, digits in ((factors, 3), (reaches, 1))
    )
    return f"""What k can stand for: an inextensible net without rubber, held at its fittings and contracted by {contraction:g}
  in the middle, has k = {both} by its exact shape, which comes back to the cylinder's within {far} radii.
  Nothing is fitted there. At rest it loses no pull; a reduced length does."""


@app.function
def by_contraction(maps, judged):
    """The mean error of each kind of ends over contraction: what shape is missing."""
    figure, panels = plt.subplots(1, len(maps), figsize=(9, 3.4), sharey=True, layout="constrained")
    for number, (axes, one) in enumerate(zip(panels, maps, strict=True)):
        at = [float(np.mean(run.contraction)) for run in one.recordings[0].runs]
        for ends, colour in COLOURS.items():
            result, mine = judged[ends], judged[ends].of(number)
            for rows, style in ((result.rows, "-o"), (result.unseen, ":")):
                each = [np.sqrt(np.mean(rows[mine & (result.level == k)] ** 2)) for k in range(len(at))]
                axes.semilogy(at, each, style, color=colour, markersize=4, label=ends if style == "-o" else None)
        axes.set(title=one.name, xlabel="contraction")
    panels[0].set_ylabel("rms error [% of full scale]")
    panels[1].plot([], [], ":", color=GREY, label="at a contraction left out")
    panels[1].legend(fontsize=7)
    return figure


@app.function
def shapes(angle=ANGLE, ratio=0.5):
    """What the ends do to the ideal force."""
    eps = np.linspace(0, 0.5, 200)
    curves = {
        CYLINDER: braid.ideal_force(eps, 1.0, 1.0, angle),
        CONES: braid.cone_force(eps, 1.0, 1.0, angle, ratio),
        AS_PRINTED: braid.cone_force_printed(eps, 1.0, 1.0, angle, ratio),
    }
    figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
    for ends, force in curves.items():
        axes.plot(eps, force / np.pi, color=COLOURS[ends], label=ends)
    bare = braid.cone_force_printed(eps, 1.0, 1.0, angle, 0.0)
    axes.plot(eps, bare / np.pi, ":", color=COLOURS[AS_PRINTED], label=f"{AS_PRINTED}, no cones")
    axes.axhline(0, color=GREY, linewidth=0.6)
    axes.set(xlabel="contraction", ylabel="force / (section x pressure)", ylim=(-4, 15))
    axes.legend(fontsize=8)
    return figure


if __name__ == "__main__":
    app.run()
