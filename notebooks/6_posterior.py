import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium")

with app.setup(hide_code=True):
    import marimo as mo

    from fitting import example_data, fit, read_experiment, sample, sealed_truth, showing, use_64_bit
    from fitting.report import pairs
    from mckibben_jax import CoulombFriction, IdealCylinder, TextileFriction

    use_64_bit()

    READINGS, STEPS = 1000, 1000  # thinned to so many readings, sampled by so many steps at most
    FEW_READINGS = 300  # enough to show that a model is wrong


@app.cell(hide_code=True)
def _():
    mo.md("""
    # 6. Posterior: what is known, and how well

    A fit gives one value and an error bar. But parameters hang together: a little more radius can be compensated by a
    little less braid angle. The posterior is all the values that the data allow, and how probable each is. It is drawn
    here by emcee, with walkers that compare models with data some ten thousand times. At the end you will have seen an interval that
    holds the truth, and a wrong model whose intervals are not to be believed, and that says so.

    The muscle is that of notebook 3, with the friction law that was found there.
    """)
    return


@app.cell
def _():
    muscle = read_experiment(example_data("muscle_b"))
    best = fit([muscle], [IdealCylinder(), TextileFriction()])
    known = sample(best, [muscle], rows=READINGS, max_steps=STEPS)
    return best, known, muscle


@app.cell
def _(known):
    pairs(known)
    return


@app.cell(hide_code=True)
def _(best, known):
    truth = {**sealed_truth("muscle_b")["parameters"]}
    truth |= {f"muscle.{name}": value for name, value in sealed_truth("muscle_b")["muscle"].items()}
    inside = {name: q.q05 <= truth[name] <= q.q95 for name, q in known.parameters.items()}
    rows = "\n    ".join(
        f"| `{name}` | {showing.show(q.q05, q.unit)} | {showing.show(q.median, q.unit)} | {showing.show(q.q95, q.unit)} | "
        f"{showing.show(best.values[name], q.unit)} | {showing.show(truth[name], q.unit)} |"
        for name, q in known.parameters.items()
    )
    mo.md(f"""
    The dark areas hold half of all that the data allow, the light ones nine tenths. **Tilted areas are correlated
    parameters**: radius and angle are known together much better than apart.

    | parameter | 5 % | median | 95 % | the fit | the truth |
    |---|---|---|---|---|---|
    {rows}

    Nine times in ten the truth should lie between the 5 % and the 95 % column, for each parameter. Here it does for
    {sum(inside.values())} of {len(inside)}. One data set proves nothing (with 600 of the readings it was 3 of 4, with 400 2 of
    4); `tests/test_posterior_studies.py` counts over many.
    """)
    return (inside,)


@app.cell(hide_code=True)
def _(known):
    mo.md(f"""
    ## May it be believed?

    Two things can go wrong. The walkers may not have been everywhere yet: R-hat compares independent groups of
    walkers and should be below 1.01; here the largest is {max(q.rhat for q in known.parameters.values()):.4f}. Or the
    **model** may be wrong: then the walkers agree, and agree on nonsense. So the program asks of every posterior what a
    diagnosis asks: is anything missing? Here: {warnings_of(known)}.

    The same with Coulomb friction, of which we know that it is the wrong law here:
    """)
    return


@app.cell
def _(muscle):
    wrong = sample(fit([muscle], [IdealCylinder(), CoulombFriction()]), [muscle], rows=FEW_READINGS, max_steps=STEPS)
    return (wrong,)


@app.cell(hide_code=True)
def _(wrong):
    mo.md(f"""
    > {warnings_of(wrong)}

    Without such a warning its narrow, confident and wrong intervals would look just like the good ones.
    """)
    return


@app.cell(hide_code=True)
def _(inside, known, wrong):
    _beta = known.parameters["textile_friction.beta"]
    answer = f"""
    The exponent of friction is {_beta.median:.4f}, with 90 % between {_beta.q05:.4f} and {_beta.q95:.4f};
    {sum(inside.values())} of {len(inside)} true values lie inside. The right model is
    {"trusted" if known.trusted else "not trusted"}, the wrong one {"trusted" if wrong.trusted else "not trusted"}.
    """
    if not mo.running_in_notebook():
        print(answer)
    mo.md(f"""
    ## What you have seen

    {answer}

    On the command line: `mckibben posterior my_muscle/ --effects ideal_cylinder textile_friction`. It keeps its chains
    in a file and goes on where it was stopped. Next: **7. Design**.
    """)
    return


@app.function(hide_code=True)
def warnings_of(posterior):
    """What speaks against a posterior."""
    return "; ".join(posterior.warnings) or "no warning"


if __name__ == "__main__":
    app.run()
