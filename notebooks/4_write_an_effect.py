import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium")

with app.setup(hide_code=True):
    from dataclasses import replace

    import jax
    import jax.numpy as jnp
    import marimo as mo
    import numpy as np
    from drawing import errors

    from fitting import diagnose, effect_from_line, example_data, fit, read_experiment, use_64_bit
    from mckibben_jax import BladderNeoHookean, CoulombFriction, IdealCylinder, LinearSpring, Pulling, Tip, parameter

    use_64_bit()

    BASELINE = [IdealCylinder(), CoulombFriction()]
    AMPLITUDE, PITCH = 5.0, 0.012  # N, m: what we do to the data


@app.cell(hide_code=True)
def _():
    mo.md("""
    # 4. Write an effect

    The library cannot know your rig. Suppose that a drive screw moves your muscle's end, and that once a turn it pushes
    and pulls a little: 5 N, every 12 mm. We take a muscle of which we know that nothing is missing (notebook 3) and do
    just that to its recording. At the end you will have seen such an effect written in ten lines, and in one, and the
    program name it among all others.
    """)
    return


@app.cell
def _():
    clean = read_experiment(example_data("muscle_d"))
    muscle = with_a_screw(clean)
    before = fit([muscle], BASELINE)
    errors(muscle, ("what the model misses", before))
    return before, muscle


@app.cell(hide_code=True)
def _():
    mo.md("""
    A ripple that depends on where the muscle is, and not on pressure or direction. No rubber does that. Would the
    program know?
    """)
    return


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## An effect is a class

    Four things: what it is (the docstring), its parameters (value, unit, meaning, range), and one method. The kind of
    effect says which method: a `Felt` effect changes what the braid feels, an `Energy` effect stores joules, a
    `Pulling` effect pulls in newtons, a `Lost` effect costs motion, a `Read` effect belongs to the instrument.
    """)
    return


@app.class_definition
class Screw(Pulling):
    """The drive screw of our rig pushes and pulls once a turn."""

    A: jax.Array = parameter(1.0, "N", "amplitude", range=(-20, 20))
    pitch: jax.Array = parameter(0.012, "m", "pitch", range=(0.011, 0.013))

    def force(self, muscle, state):
        return self.A * jnp.sin(2 * jnp.pi * muscle.length * state.contraction / self.pitch)


@app.cell(hide_code=True)
def _():
    mo.md("""
    That is all. No list to enter it into, no derivative to write: the program differentiates it, and from the
    declaration it knows the unit, the bounds and what to print. So it is a candidate like the library's own:
    """)
    return


@app.cell
def _(muscle):
    candidates = [Screw(), BladderNeoHookean(), LinearSpring(), Tip()]
    found = diagnose([muscle], BASELINE, candidates=candidates)
    return (found,)


@app.cell(hide_code=True)
def _(found):
    rows = "\n".join(
        f"| `{e.name}` | {e.held_out_rmse:.2f} | {'yes' if e.adequate else 'no'} |" for e in found.effects.values()
    )
    mo.md(f"""
    | with this effect added | error on held-out runs [N] | explains the data |
    |---|---|---|
    {rows}

    The verdict: **{found.verdict}**: {", ".join(" + ".join(f"`{name}`" for name in e) for e in found.explanations)}.
    """)
    return


@app.cell
def _(before, muscle):
    after = fit([muscle], [*BASELINE, Screw()])
    errors(muscle, ("before", before), ("with the screw", after))
    return (after,)


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## Or one line

    For a force that one can write down, no class is needed. The line is read, checked for its dimension and
    differentiated; it is never run as code, and the model file keeps it. Names that it may use: `x` shortening, `eps`
    contraction, `v` speed, `P` pressure, `t` time, `r` radius, `alpha` angle, `S` contact surface, `F0` the ideal force.
    """)
    return


@app.cell
def _(muscle):
    line = "ripple = A*sin(2*pi*x/p), A = 1 N (-20..20), p = 12 mm (11..13)"
    same = fit([muscle], [*BASELINE, effect_from_line(line)()])
    return (same,)


@app.cell(hide_code=True)
def _(after, same):
    mo.md(f"""
    The model with the line is {same.rmse:.4f} N off, that with the class {after.rmse:.4f} N.
    """)
    return


@app.cell(hide_code=True)
def _(after, before, found, same):
    answer = f"""
    Without the screw {before.rmse:.2f} N, with it {after.rmse:.2f} N; by the one line {same.rmse:.2f} N. Found: amplitude
    {after.values["screw.A"]:.2f} +/- {after.error("screw.A"):.2f} N of {AMPLITUDE:g}, pitch
    {1e3 * after.values["screw.pitch"]:.3f} +/- {1e3 * after.error("screw.pitch"):.3f} mm of {1e3 * PITCH:g}.
    The verdict is {found.verdict}: {", ".join("+".join(e) for e in found.explanations)}.
    """
    if not mo.running_in_notebook():
        print(answer)
    mo.md(f"""
    ## What you have seen

    {answer}

    With the class in a file of yours:

    ```
    mckibben diagnose my_muscle/ --effect-file screw.py
    mckibben add      my_muscle/ screw --effect-file screw.py
    ```

    or `mckibben add my_muscle/ ripple --define "ripple = A*sin(2*pi*x/p), A = 1 N (-20..20), p = 12 mm (11..13)"`.

    If you do not know the form, `mckibben diagnose my_muscle/ --propose` looks for one.
    Next: **5. Quick release and Hill**.
    """)
    return


@app.function(hide_code=True)
def with_a_screw(experiment):
    """The same data set, had a drive screw pushed and pulled."""
    length = float(experiment.muscle.length)

    def pushed(run):
        ripple = AMPLITUDE * np.sin(2 * np.pi * length * run.contraction / PITCH)
        return replace(run, measured=run.measured + ripple)

    recordings = tuple(replace(r, runs=tuple(map(pushed, r.runs))) for r in experiment.recordings)
    return replace(experiment, recordings=recordings)


if __name__ == "__main__":
    app.run()
