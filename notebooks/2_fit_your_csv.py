import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium")

with app.setup(hide_code=True):
    import tempfile
    from pathlib import Path

    import marimo as mo
    from drawing import loops

    from fitting import InputError, compare, example_data, fit, read_experiment, use_64_bit, write_muscle_file
    from fitting.report import error_text, kind_text, with_error, worst_text
    from mckibben_jax import CoulombFriction, IdealCylinder

    use_64_bit()


@app.cell(hide_code=True)
def _():
    mo.md("""
    # 2. Fit your CSV

    You have a CSV file from your rig. At the end you will have seen it become parameters with honest errors, and where
    the model fails on it: in four steps. To do it with your own, write its folder into `MINE` below, and your sizes into
    `SIZES`; all else follows.
    """)
    return


@app.cell
def _():
    MINE = ""  # the path of your folder of CSV files; while it is empty, we make one
    SIZES = {"length": "300 mm", "radius": "7.0 +/- 0.1 mm", "braid_angle": "20.0 +/- 0.3 deg"}
    return MINE, SIZES


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## Step 1: a folder with your file in it

    Ours is written here, as a rig might: semicolons, pressure in bar, units in round brackets.
    What is needed: time, pressure, force, and one of contraction, length or stroke.
    """)
    return


@app.cell(hide_code=True)
def _(MINE):
    folder = Path(MINE) if MINE else written_by_a_rig(Path(tempfile.mkdtemp()) / "monday")
    head = "\n".join(next(folder.glob("*.csv")).read_text(encoding="utf-8").splitlines()[:4])
    mo.md(f"```\n{head}\n...\n```")
    return (folder,)


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## Step 2: say which muscle it was

    `mckibben init FOLDER` looks at the files and writes a `muscle.toml` beside them, with its guesses and with question
    marks for what only you know. (Here by its Python name. One that is already there is left alone.)
    """)
    return


@app.cell(hide_code=True)
def _(folder):
    told = folder / "muscle.toml" if (folder / "muscle.toml").exists() else write_muscle_file(folder)
    template = told.read_text(encoding="utf-8")
    mo.md(f"```toml\n{template}\n```")
    return template, told


@app.cell(hide_code=True)
def _():
    mo.md("""
    Three values must be filled in. Forget it, and you are told which, where, and what to do. So it is with every
    mistake in a file:
    """)
    return


@app.cell(hide_code=True)
def _(folder):
    try:
        read_experiment(folder)
        complaint = "(nothing to complain about)"
    except InputError as problem:
        complaint = str(problem).replace(str(folder.parent), "...")
    mo.md(f"> {complaint}")
    return (complaint,)


@app.cell(hide_code=True)
def _():
    mo.md("""
    Write what you measured. **How well do you know it?** `7.0 +/- 0.1 mm` says: fitted, but held near 7.0 by
    that error. `300 mm` says: exact, leave it.
    """)
    return


@app.cell
def _(SIZES, complaint, folder, template, told):
    filled = template
    for name, unit in (("length", "mm"), ("radius", "mm"), ("braid_angle", "deg")):
        filled = filled.replace(f'\n{name} = "? {unit}"', f'\n{name} = "{SIZES[name]}"')
    if complaint and filled != template:
        told.write_text(filled, encoding="utf-8")
    muscle = read_experiment(folder)
    return (muscle,)


@app.cell(hide_code=True)
def _(muscle):
    _runs = [run for recording in muscle.recordings for run in recording.runs]
    _notes = "".join(f"\n- {note}" for recording in muscle.recordings for note in recording.notes)
    mo.md(f"""
    Read: {len(_runs)} runs with {sum(map(len, _runs)):,} readings; all in SI units from here on. What was set aside
    is said, never silent:
    {_notes or "nothing"}
    """)
    return


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## Step 3: fit

    The ideal law with dry friction is where every study begins.
    """)
    return


@app.cell
def _(muscle):
    fitted = fit([muscle], [IdealCylinder(), CoulombFriction()])
    return (fitted,)


@app.cell(hide_code=True)
def _(fitted):
    mo.md(f"""
    | parameter | value | error | error, if readings were independent |
    |---|---|---|---|
    {table(fitted)}

    **Believe the first error.** A thousand readings of one loop are not a thousand independent measurements: what the
    model gets wrong, it gets wrong for the whole loop. The first column counts loops, the second counts readings.
    """)
    return


@app.cell(hide_code=True)
def _():
    mo.md("""
    ## Step 4: look where it fails
    """)
    return


@app.cell
def _(fitted, muscle):
    compared = compare(fitted, [muscle])
    loops(muscle, ("ideal law with friction", fitted))
    return (compared,)


@app.cell(hide_code=True)
def _(compared, fitted, muscle):
    _readings = sum(len(run) for recording in muscle.recordings for run in recording.runs)
    answer = f"""
    {_readings} readings, {error_text(compared)} {worst_text(compared)} {kind_text(compared)}.

    The friction coefficient comes out as f_s = {fitted.values["coulomb_friction.f_s"]:.4f} +/-
    {fitted.error("coulomb_friction.f_s"):.4f}, or +/- {fitted.error("coulomb_friction.f_s", robust=False):.5f} if one
    believed that readings are independent.
    """
    if not mo.running_in_notebook():
        print(answer)
    mo.md(f"""
    ## What you have seen

    {answer}

    On the command line: `mckibben init monday`, fill in the question marks, `mckibben compare monday`.
    A page to keep: `mckibben compare monday --html page.html`.
    What is missing from the model is the question of the next notebook: **3. What is missing?**
    """)
    return


@app.function(hide_code=True)
def written_by_a_rig(place):
    """A folder with the recording of the shipped muscle B, as another rig might have written it."""
    place.mkdir(parents=True)
    rows = (example_data("muscle_b") / "loops.csv").read_text(encoding="utf-8").splitlines()[1:]
    lines = ["run;Time (s);Pressure [bar];Stroke (mm);Load cell (N)"]
    for row in rows:
        run, time, kilopascals, stroke, force = row.split(",")
        lines.append(f"{run};{time};{float(kilopascals) / 100:.4f};{stroke};{force}")
    (place / "monday.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return place


@app.function(hide_code=True)
def table(fitted):
    """The parameters that varied, with both errors, as rows of a table."""
    rows = []
    for entry in fitted.layout.entries:
        if entry.name in fitted.free:
            value = fitted.values[entry.name]
            shown, robust = with_error(value, fitted.error(entry.name), entry.unit)
            independent = with_error(value, fitted.error(entry.name, robust=False), entry.unit)[1]
            rows.append(f"| `{entry.name}` | {shown} | {robust} | {independent} |")
    return "\n    ".join(rows)


if __name__ == "__main__":
    app.run()
