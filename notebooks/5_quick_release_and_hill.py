import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium")

with app.setup(hide_code=True):
    import marimo as mo
    import matplotlib.pyplot as plt
    import numpy as np

    from fitting import example_data, fit, hill_curves, quick_releases, read_experiment, sealed_truth, use_64_bit
    from fitting.report import BLUE, GREEN, GREY, VERMILION, speed_over_load
    from mckibben_jax import BladderNeoHookean, Hill, IdealCylinder, KineticFriction, TextileFriction

    use_64_bit()

    STATICS = [IdealCylinder(), BladderNeoHookean(), TextileFriction()]
    COLOURS = (BLUE, VERMILION, GREEN)


@app.cell(hide_code=True)
def _():
    mo.md("""
    # 5. Quick release and Hill

    A. V. Hill held a frog's muscle at its length, let it go under a load, and read the speed at which it shortened:
    the heavier the load, the slower, along a hyperbola. The review does the same with a braided muscle (Tondu 2012,
    figures 17, 18): a magnet holds it inflated at its rest length and lets go. **Is a McKibben muscle a Hill muscle?**

    At the end you will have seen that its speeds do lie on Hill's curve, and that dry friction which grows with speed,
    not Hill's viscous force, draws it.

    The recording: six loads, 5 bar, position over time.
    """)
    return


@app.cell
def _():
    (muscle,) = quick_releases([read_experiment(example_data("rayon20"))])
    (read,) = hill_curves([muscle])
    positions(muscle, read)
    return muscle, read


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## The speed at each load

    The black stretch of each recording is the straight part from which the speed is read. Speed over load, with Hill's
    law through it:

    $$(F/F_0 + a/F_0)\,(V/V_{max}) = (1 - F/F_0)\,a/F_0$$

    One number, $a/F_0$, says how bent the curve is. Animals have 0.12 to 0.4; the review's rayon muscle has 0.12, its
    iron muscle 0.54.
    """)
    return


@app.cell
def _(read):
    speed_over_load([read])
    return


@app.cell(hide_code=True)
def _(read):
    mo.md(f"""
    a/F0 = **{read.hill.curvature:.3f} +/- {read.hill.curvature_error:.3f}**, and the curve is {100 * read.hill.misfit:.1f}
    % off the readings. A splendid Hill muscle, it seems. The red curve is the same load thrown up by a spring with
    dry friction, without any viscosity: {100 * read.dry.misfit:.1f} % off, which is worse, but not by much; read as
    Hill's it has a/F0 = {read.dry.read_as_hill.curvature:.2f}. **A good hyperbola is weak evidence.**

    ## Ask the motion itself

    The whole recorded motion says more than one speed. Three models are fitted to all positions at once: the ideal law
    with rubber and dry textile friction; the same with Hill's viscous force; the same with a friction that grows with
    speed, as lubricated yarn does (eq. 48).
    """)
    return


@app.cell
def _(muscle):
    models = {
        "dry friction": fit([muscle], STATICS, starts=1),
        "and Hill's viscous force": fit([muscle], [*STATICS, Hill()], starts=1),
        "and friction that grows with speed": fit([muscle], [*STATICS, KineticFriction()], starts=1),
    }
    return (models,)


@app.cell
def _(models, muscle):
    motions(muscle, models)
    return


@app.cell(hide_code=True)
def _(models, read):
    _dry, _hill, _kinetic = models.values()
    _names = ("kinetic_friction.ratio", "kinetic_friction.v_s")
    _found = [f"{_kinetic.values[n]:.3g} +/- {_kinetic.error(n):.1g}" for n in _names]
    _real = [f"{sealed_truth('rayon20')['parameters'][n]:g}" for n in _names]
    answer = f"""
    Hill's law fits the speeds to {100 * read.hill.misfit:.1f} % with a/F0 = {read.hill.curvature:.3f}. The motion itself
    says: {1e3 * _dry.rmse:.2f} mm off with dry friction, {1e3 * _hill.rmse:.2f} mm with Hill's viscous force,
    {1e3 * _kinetic.rmse:.3f} mm with friction that grows with speed; the noise is 0.05 mm. Friction grows {_found[0]} fold
    over a speed of {_found[1]} m/s; put in were {_real[0]} and {_real[1]}.
    """
    if not mo.running_in_notebook():
        print(answer)
    mo.md(f"""
    ## What you have seen

    {answer}

    So Hill's *curve* was right and Hill's *mechanism* was not: nothing viscous is in this muscle.

    On the command line: `mckibben hill my_releases/`; it warns when dry friction would give the same curve. The study
    `hill_or_not.py` goes further. Next: **6. Posterior**.
    """)
    return


@app.function(hide_code=True)
def positions(muscle, read):
    """Recorded shortening over time; the straight part that gives the speed in black."""
    figure, axes = plt.subplots(figsize=(6.6, 3.6), layout="constrained")
    used = {reading.run: reading for reading in read.hill.readings}
    for run in muscle.recordings[0].runs:
        axes.plot(run.time, 1e3 * run.measured, color=BLUE, linewidth=1)
        reading = used[run.name]
        part = (run.time >= reading.begin) & (run.time <= reading.end)
        axes.plot(run.time[part], 1e3 * run.measured[part], color="black", linewidth=2.5)
        axes.annotate(f"{reading.load:.0f} N", (run.time[-1], 1e3 * run.measured[-1]), xytext=(4, 0),
                      textcoords="offset points", va="center", fontsize=8)  # fmt: skip
    axes.set(xlabel="time since the release [s]", ylabel="shortening [mm]", xlim=(-0.01, 0.66))
    axes.spines[["top", "right"]].set_visible(False)
    return figure


@app.function(hide_code=True)
def motions(muscle, models):
    """Every release with the three models, and by how much each is off."""
    runs = muscle.recordings[0].runs
    figure, panels = plt.subplots(2, 3, figsize=(9.6, 4.8), layout="constrained", sharex=True)
    for number, (run, axes) in enumerate(zip(runs, panels.flat, strict=True)):
        axes.plot(run.time, 1e3 * run.measured, ".", color=GREY, markersize=2.5)
        for (name, fitted), colour in zip(models.items(), COLOURS, strict=True):
            mine = fitted.samples.run == number
            model = run.measured[fitted.samples.position[mine]] + fitted.residual[mine]
            label = f"{name}: {1e3 * fitted.rmse:.2f} mm off"
            axes.plot(run.time[fitted.samples.position[mine]], 1e3 * model, color=colour, linewidth=1.1, label=label)
        axes.set_title(f"{np.mean(run.load):.0f} N", loc="left", fontsize=9)
        axes.spines[["top", "right"]].set_visible(False)
    figure.supxlabel("time since the release [s]", fontsize=9)
    figure.supylabel("shortening [mm]", fontsize=9)
    figure.legend(
        *panels[0][0].get_legend_handles_labels(), loc="outside upper left", ncols=3, fontsize=8, frameon=False
    )
    return figure


if __name__ == "__main__":
    app.run()
