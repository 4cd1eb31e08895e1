import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium")

with app.setup(hide_code=True):
    import marimo as mo
    from drawing import errors, loops

    from fitting import compare, diagnose, effects_named, example_data, fit, read_experiment, sealed_truth, use_64_bit
    from fitting.report import effects_picture, kind_text, leading_text, readable, verdict_text
    from mckibben_jax import CoulombFriction, IdealCylinder, with_effects

    use_64_bit()

    BASELINE = [IdealCylinder(), CoulombFriction()]


@app.cell(hide_code=True)
def _():
    mo.md("""
    # 3. What is missing?

    Two muscles whose makers put in something that they did not say, or nothing. The answers are sealed in files that
    nothing below opens before the last cell. At the end you will have seen the program name what is missing in the one,
    find nothing in the other, and the seals opened. Decide for yourself before you get there.

    First a muscle that is **not** well described by the ideal law with dry friction:
    """)
    return


@app.cell
def _():
    SUSPECT, CONTROL = "muscle_b", "muscle_d"  # also try muscle_a and muscle_c
    return CONTROL, SUSPECT


@app.cell
def _(SUSPECT):
    suspect = read_experiment(example_data(SUSPECT))
    before = fit([suspect], BASELINE)
    compared = compare(before, [suspect])
    loops(suspect, ("ideal law with dry friction", before))
    return before, compared, suspect


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## Look before you ask

    The fit is not bad. But look at the shape of what is left, with shortening and lengthening in one picture:
    """)
    return


@app.cell
def _(before, suspect):
    errors(suspect, ("what the model misses", before))
    return


@app.cell(hide_code=True)
def _(compared):
    mo.md(f"""
    Two bands for each pressure, mirrored about zero: the error changes its sign with the direction of motion. An effect
    of the rubber, of the ends or of the length at rest could not do that. Friction could. The program puts it so:

    > {kind_text(compared)}

    Friction as the model has it (Coulomb) grows in proportion to pressure. Here the model's loop is too wide at the
    highest pressure and too narrow at the others. Something grows *less* than in proportion.
    """)
    return


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## Ask

    All of the library is tried: alone, in pairs, in triples, each refitted jointly and tested for whether anything is
    still missing. This takes about a minute, nearly all of it compiling.
    """)
    return


@app.cell
def _(suspect):
    found = diagnose([suspect], BASELINE)
    effects_picture(found, found.noise_floor)
    return (found,)


@app.cell(hide_code=True)
def _(found):
    mo.md(f"""
    > {readable(verdict_text(found))}
    >
    > {readable(leading_text(found) or "")}

    The bars are errors on runs that were **held out** of the fit. The test behind the verdict rests on: {found.rests_on}. If
    nothing were missing, whole loops of the error could have their signs flipped and look the same; here they do
    not (p = {found.p_value:.2g}).
    """)
    return


@app.cell
def _(before, found, suspect):
    added = [kind() for kind in effects_named(found.explanations[0])]
    after = fit([suspect], with_effects(BASELINE, added))
    errors(suspect, ("before", before), (f"with {', '.join(found.explanations[0])}", after))
    return (after,)


@app.cell(hide_code=True)
def _():
    mo.md("""
    It *replaces* Coulomb friction: both are laws of the same dry friction, and a model holds one of them.

    ## A control

    A doctor who finds something in every patient is no doctor. The second muscle:
    """)
    return


@app.cell
def _(CONTROL):
    control = read_experiment(example_data(CONTROL))
    alone = fit([control], BASELINE)
    acquitted = diagnose([control], BASELINE)
    return acquitted, alone


@app.cell(hide_code=True)
def _(acquitted, alone):
    mo.md(f"""
    > {readable(verdict_text(acquitted))}

    p = {acquitted.p_value:.2g}; the model is {alone.rmse:.2f} N off, the noise is {acquitted.noise_floor:.2f} N.
    """)
    return


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## The seals are opened
    """)
    return


@app.cell(hide_code=True)
def _(CONTROL, SUSPECT, acquitted, after, found):
    answer = f"""
    {verdict_on(SUSPECT, found)} {verdict_on(CONTROL, acquitted)}

    Error of {SUSPECT}: {found.rmse:.1f} N before, {after.rmse:.2f} N after.
    """
    if not mo.running_in_notebook():
        print(answer)
    rows = "\n    ".join(
        f"| `{name}` | {after.values[name]:.5g} +/- {after.error(name):.2g} | {value:.5g} |"
        for name, value in sealed_truth(SUSPECT)["parameters"].items()
        if name in after.values
    )
    mo.md(f"""
    {answer}

    | parameter | found | put in |
    |---|---|---|
    {rows}

    The simulator that made these data shares no code with the program (`tests/hidden`). On your own muscle no
    seal can be opened; there the verdict can also be "one of these", "not in the library" or "inconclusive", and
    `mckibben plan` says which recording would settle it.

    Next: **4. Write an effect**, for when it is none of the library's.
    """)
    return


@app.function(hide_code=True)
def verdict_on(name, said):
    """What was said of a muscle, what was hidden in it, and whether that is the same."""
    hidden = sealed_truth(name)["hidden"]
    found = " or ".join(" and ".join(e) for e in said.explanations) or "nothing"
    right = sorted(map(sorted, said.explanations)) == ([sorted(hidden)] if hidden else [])
    return f"{name}: found {found}, hidden was {' and '.join(hidden) or 'nothing'}: {'right' if right else 'WRONG'}."


if __name__ == "__main__":
    app.run()
