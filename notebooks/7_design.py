import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium")

with app.setup(hide_code=True):
    from dataclasses import replace

    import marimo as mo
    import matplotlib.pyplot as plt
    import numpy as np

    from fitting import use_64_bit
    from fitting.report import BLUE, GREY, VERMILION, design_text, price_text, stroke_of, to_scale
    from mckibben_jax import Muscle
    from mckibben_jax.design import DESIGN_BASELINE, QUANTITIES, Limit, Task, built, design

    use_64_bit()

    PRESSURE = 5e5
    AT = {"contraction": 0.1, "pressure": PRESSURE}
    ANGLES = np.radians([12.0, 40.0])
    RUBBER = tuple(kind() for kind in DESIGN_BASELINE)  # the ideal law and the rubber of the tube
    START = Muscle(0.3, 0.008, np.radians(20), wall_thickness=1e-3, shear_modulus=0.54e6, breaking_stress=28e6)


@app.cell(hide_code=True)
def _():
    mo.md("""
    # 7. Design: the muscle for the job

    Wanted: a muscle, 300 mm long and 16 mm thick, that pulls as hard as possible at 5 bar when it has shortened by 10 %.
    Which braid angle, which thickness of the rubber's wall? At the end you will have seen the best muscle, which limits
    hold it there, what each limit costs in newtons, and a wish that cannot be met.

    The ideal law has a plain answer: **the smaller the angle, the better**, without end, and no rubber at all. That
    cannot be. Look at what else changes with the angle (wall of 1 mm):
    """)
    return


@app.cell
def _():
    angles = np.linspace(*ANGLES, 40)
    figure_of(angles, *over_angle(angles))
    return


@app.cell(hide_code=True)
def _():
    mo.md("""
    A small angle lets the braid open further: the tube is stretched further around, its wall gets thinner, and it tears
    at a lower pressure. A thicker wall holds more, but it costs force, and pressure before anything moves at all. So
    the question is only well put with its limits:

    - at 5 bar the wall must not tear (`burst_pressure`),
    - it must work from 1 bar on (`minimum_pressure`),
    - it must shorten by 20 % (`stroke`).
    """)
    return


@app.cell
def _():
    task = Task(
        START,
        {"braid_angle": tuple(ANGLES), "wall_thickness": (0.3e-3, 3e-3)},
        "force",
        AT,
        (
            Limit("minimum_pressure", max=1e5),
            Limit("burst_pressure", min=PRESSURE),
            Limit("stroke", {"pressure": PRESSURE}, min=0.2),
        ),
        starts=6,
    )
    best = design(task)
    return best, task


@app.cell(hide_code=True)
def _(best):
    mo.md(f"```\n{design_text(best)}\n```")
    return


@app.cell
def _(best, task):
    pressure, stroke = stroke_of(task, best)
    to_scale(best.muscle, stroke, pressure)
    return


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## What does each limit cost?

    The optimum comes by exact gradients, and with it, for each limit that holds it, a price (a *multiplier*): what a
    little more of the limit would bring. Does the price hold when it is paid? Ask for 1.1 bar in place of 1:
    """)
    return


@app.cell
def _(best, task):
    _looser = (replace(task.constraints[0], max=1.1e5), *task.constraints[1:])
    relaxed = design(replace(task, constraints=_looser))
    predicted = best.constraints[0].multiplier * 0.1e5
    gained = relaxed.value - best.value
    return gained, predicted


@app.cell(hide_code=True)
def _(best, gained, predicted):
    mo.md(f"""
    Predicted: {predicted:+.1f} N. Gained: {gained:+.1f} N. {"; ".join(price_text(best))}.
    """)
    return


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## Too much asked

    To work from 0.2 bar on, to bear 8 bar and to shorten by 35 %: such a wish is answered by which of its parts fight each other.
    """)
    return


@app.cell
def _(task):
    _limits = zip(task.constraints, ({"max": 0.2e5}, {"min": 8e5}, {"min": 0.35}), strict=True)
    _greedy = tuple(replace(limit, **more) for limit, more in _limits)
    impossible = design(replace(task, constraints=_greedy))
    return (impossible,)


@app.cell(hide_code=True)
def _(impossible):
    mo.md(f"> {design_text(impossible).splitlines()[0]}")
    return


@app.cell(hide_code=True)
def _(best, gained, impossible, predicted):
    _held = [m.quantity for m in (*best.constraints, *best.variables) if m.active]
    answer = f"""
    The best muscle has a braid angle of {np.degrees(float(best.muscle.braid_angle)):.2f} deg and a wall of
    {1e3 * float(best.muscle.wall_thickness):.3f} mm; it pulls {best.value:.0f} N. Held by: {", ".join(_held)}. A limit of 1.1 bar in place of 1 brings {gained:.1f} N ({predicted:.1f} N predicted).
    Outcome of the impossible wish: {impossible.outcome}; fighting: {", ".join(impossible.fighting)}.
    """
    if not mo.running_in_notebook():
        print(answer)
    mo.md(f"""
    ## What you have seen

    {answer}

    On the command line the same stands in a file of twenty lines: `mckibben design spec.toml` (how-to, "Design a muscle"). With `[tolerance]`
    it designs for what is really made, with `[pareto]` it draws the trade-off, and `mckibben sweep` goes through designs
    by the million.

    That was the last of the seven. The other notebooks here are studies: questions that the review left open.
    """)
    return


@app.function(hide_code=True)
def over_angle(angles):
    """Force (N) and burst pressure (Pa) at each braid angle."""
    models = [built(replace(START, braid_angle=angle), RUBBER) for angle in angles]
    force = [float(QUANTITIES["force"].law(model, AT)) for model in models]
    return np.array(force), np.array([float(QUANTITIES["burst_pressure"].law(model, {})) for model in models])


@app.function(hide_code=True)
def figure_of(angles, force, burst):
    """Force and burst pressure over the braid angle."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    left.plot(np.degrees(angles), force, color=BLUE)
    left.set(xlabel="braid angle at rest [deg]", ylabel="force at 5 bar, 10 % shorter [N]", ylim=(0, None))
    right.plot(np.degrees(angles), burst / 1e5, color=VERMILION)
    right.axhline(PRESSURE / 1e5, color=GREY, linestyle="--")
    right.annotate("what is asked", (np.degrees(angles[-1]), PRESSURE / 1e5), va="bottom", ha="right", fontsize=8)
    right.set(xlabel="braid angle at rest [deg]", ylabel="the wall tears at [bar]", ylim=(0, None))
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    return figure


if __name__ == "__main__":
    app.run()
