import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium")

with app.setup(hide_code=True):
    import marimo as mo
    from drawing import errors, loops

    from fitting import Stage, diagnose, example_data, fit, read_experiment, use_64_bit
    from fitting.report import waterfall
    from mckibben_jax import (
        BladderNeoHookean,
        CoulombFriction,
        IdealCylinder,
        LinearSpring,
        Presliding,
        TextileFriction,
        Tip,
        ViscousDamping,
    )

    use_64_bit()  # 64-bit numbers; compiled code is kept, so that the second run is quick


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # 1. Five minutes

    A McKibben muscle is a rubber tube in a braided sheath. Inflate it, and it shortens and pulls. What it *should* pull
    is known since the 1960s (Tondu 2012, eq. 10):

    $$F = \pi r_0^2 P\,[a(1-\varepsilon)^2 - b], \qquad a = 3/\tan^2\alpha_0,\quad b = 1/\sin^2\alpha_0$$

    with pressure $P$, contraction $\varepsilon$, radius $r_0$ and braid angle $\alpha_0$ at rest.
    What it *really* pulls is something else. This notebook asks one muscle: **what is missing from that law?**
    At its end you will have seen an error of 18 N fall to 0.6 N, the noise, because one missing effect was named and added.

    Nothing to type: read from top to bottom. The code in each cell is all there is.
    """)
    return


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## Step 1: the measurement

    Muscle A comes with the program. It was inflated to five pressures; at each, a machine shortened and lengthened it
    twice while a load cell read the force: 10 runs, 9,000 readings. (A folder with a CSV file and a `muscle.toml`
    that says length, radius and angle; the next notebook makes one of your own.)
    """)
    return


@app.cell
def _():
    muscle = read_experiment(example_data("muscle_a"))
    return (muscle,)


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## Step 2: compare

    The model: the ideal law, plus dry friction where the strands of the braid rub on each other. Friction is why
    shortening and lengthening give two different forces, a *loop*. `fit` finds the friction coefficient, and moves
    radius and angle within the error with which they were measured.
    """)
    return


@app.cell
def _(muscle):
    model = [IdealCylinder(), CoulombFriction()]
    before = fit([muscle], model)
    return before, model


@app.cell
def _(before, muscle):
    loops(muscle, ("ideal law with friction", before))
    return


@app.cell(hide_code=True)
def _(before):
    mo.md(f"""
    Lines are the model, grey dots the measurement. The best that this model can do is **{before.rmse:.0f} N** off (root
    mean square), although the load cell is good to 0.6 N. So it is not noise. The error has a shape:
    """)
    return


@app.cell
def _(before, muscle):
    errors(muscle, ("what the model misses", before))
    return


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## Step 3: diagnose

    Which effect has this shape? `diagnose` adds every candidate in turn, fits all parameters again, and tests
    whether anything is left to be found. Here six candidates, so that it takes seconds; without the list it
    takes the whole library of some forty, and a minute.
    """)
    return


@app.cell
def _(model, muscle):
    candidates = [BladderNeoHookean(), LinearSpring(), Tip(), TextileFriction(), Presliding(), ViscousDamping()]
    found = diagnose([muscle], model, candidates=candidates)
    return (found,)


@app.cell(hide_code=True)
def _(found):
    tested = sorted((e for e in found.effects.values() if e.held_out_rmse), key=lambda e: e.held_out_rmse)
    rows = "\n".join(f"| `{e.name}` | {e.held_out_rmse:.2f} | {'yes' if e.adequate else 'no'} |" for e in tested)
    mo.md(f"""
    | with this effect added | error on held-out runs [N] | explains the data |
    |---|---|---|
    {rows}

    The verdict: **{found.verdict}**: `{found.explanations[0][0]}`. "Held-out runs" means that each run was predicted
    from the others, so that a candidate cannot win by bending itself to fit.
    """)
    return


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## Step 4: add it, and watch the error fall

    `bladder_neo_hookean` is the rubber tube itself: it is stretched around and pushed together along, and that costs
    force. Its one parameter is the rubber's shear modulus G.
    """)
    return


@app.cell
def _(model, muscle):
    after = fit([muscle], [*model, BladderNeoHookean()])
    return (after,)


@app.cell
def _(after, before, found):
    stages = [
        Stage("ideal law, friction", before.rmse, found.held_out_rmse),
        Stage("and the rubber", after.rmse, found.leading.held_out_rmse),
    ]
    waterfall(stages, found.noise_floor)
    return


@app.cell
def _(after, before, muscle):
    loops(muscle, ("before", before), ("with the rubber", after))
    return


@app.cell(hide_code=True)
def _(after, before, found):
    _G = "bladder_neo_hookean.G"
    answer = f"""
    The missing effect is **{found.explanations[0][0]}**, the rubber of the tube. The error falls from {before.rmse:.1f} N
    to {after.rmse:.2f} N, the noise of the load cell. The rubber's shear modulus is {after.values[_G] / 1e3:.1f} +/-
    {after.error(_G) / 1e3:.1f} kPa.
    """
    if not mo.running_in_notebook():
        print(answer)
    mo.md(f"""
    ## What you have seen

    {answer}

    Is it true? Muscle A is simulated, so somebody knows: `mckibben demo --reveal`.

    The same from the command line, with a page of evidence to open: `mckibben demo`. The same by clicking:
    `mckibben workbench`. Next: **2. Fit your CSV**.
    """)
    return


if __name__ == "__main__":
    app.run()
