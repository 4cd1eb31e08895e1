# /// script
# [tool.marimo.display]
# theme = "system"
# ///

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="mckibben workbench")

with app.setup(hide_code=True):
    import sys
    import tempfile
    from pathlib import Path
    from types import SimpleNamespace

    import marimo as mo
    import matplotlib  # noqa: F401  (here: marimo looks at it after every cell, and fails while a job imports it)

    from fitting.compiled.prepare import prepare

    prepare()
    from fitting.workbench import session as bench
    from fitting.workbench import data as dropping
    from fitting.workbench import asked, form as forms, form_text, home, preview
    from fitting.workbench.live import follow, live_element, live_of
    from fitting.workbench import text as words
    from fitting.errors import InputError
    from fitting.workbench.job import Job
    from fitting.study.request import Request
    from fitting.workbench.serving import data_folder, launch_options
    from fitting.shipped import example_names

    EXAMPLE = "screw = A*sin(2*pi*x/p), A = 1 N (-20..20), p = 12 mm (5..30)"


# ------------------------------------------------------------------------------------- what the session knows


@app.cell
def _():
    session, set_session = mo.state(None, allow_self_loops=True)  # undo is a button of a cell that shows it
    work, set_work = mo.state(None)  # the job under way, and what is done with its result or with its problem
    told, set_told = mo.state("")  # the last message
    dropped, set_dropped = mo.state(None)  # files that still have to be described
    wrong, set_wrong = mo.state({})  # field of their description -> what is wrong with it
    place = tempfile.TemporaryDirectory(prefix=dropping.PLACE)  # of this session alone
    return (dropped, place, session, set_dropped, set_session, set_told, set_work, set_wrong, told, work, wrong)


@app.cell
def _(place, set_dropped, set_session, set_told, set_work, set_wrong, work):
    def tell_problem(job):
        set_told(dropping.without_place(job.problem, place.name))

    def start(job, then=set_session, failed=tell_problem):
        """Begin a job; what is under way is called off."""
        if work() is not None:
            work()[0].cancel()
        set_told("")
        set_work((job, then, failed))

    def go(to):
        """Another state of the session; what is under way belongs to the one before and is called off."""
        if work() is not None:
            work()[0].cancel()
            set_work(None)
        set_session(to)

    def open_folder(request, failed=tell_problem):
        """Show the data at once; the first fit follows. Until they are read the form of dropped files stays."""

        def opened(session):
            set_dropped(None)
            set_wrong({})
            set_session(session)

        start(Job("reading", lambda tell: bench.open_session(request)), opened, failed)

    def attempt(action):
        """Do something that the user may have to mend."""
        try:
            return action()
        except (InputError, OSError) as error:  # also a full disk
            set_told(dropping.without_place(str(error), place.name))
            return None

    return attempt, go, open_folder, start, tell_problem


# ------------------------------------------------------------------------------------------------- open a data set


@app.cell
def _():
    mo.Html(words.style() + words.heading("McKibben workbench", 1))
    return


@app.cell
def _(attempt, open_folder, place, set_dropped, set_wrong):
    def take(files):
        if not files:
            return
        given = [(f.name, f.contents) for f in files]
        kept = attempt(lambda: dropping.keep(given, Path(tempfile.mkdtemp(dir=place.name))))
        if kept is None:
            return
        set_wrong({})
        if dropping.is_described(kept):
            open_folder(Request(data=(str(kept),)))
        else:
            set_dropped(attempt(lambda: dropping.guess(kept)))

    def open_named(name):
        if name:
            attempt(lambda: open_folder(Request(data=(str(data_folder(name.strip())),))))

    shipped = mo.ui.dropdown(example_names(), label="Data that come with the program", on_change=open_named)
    path = mo.ui.text(
        placeholder="/path/to/folder", label="A folder on this machine", on_change=open_named, full_width=True
    )
    files = mo.ui.file(
        multiple=True, kind="area", on_change=take, label="Drop a data set here: its recordings, and muscle.toml if any"
    )
    return files, open_named, path, shipped


@app.cell
def _(open_named, opened_once, session):
    given = launch_options()["data"] if mo.running_in_notebook() else None
    if given and session() is None and not opened_once:
        opened_once.append(given)
        open_named(given)
    return


@app.cell
def _():
    opened_once = []
    return (opened_once,)


@app.cell
def _(files, path, session, shipped):
    opener = mo.vstack([files, shipped, path])
    first = session() is None
    shown_data = [mo.md(words.WELCOME), opener] if first else [mo.accordion({"Open another data set": opener})]
    mo.vstack([mo.Html(words.heading("Data")), *shown_data])
    return


# ------------------------------------------------------------------------- what the headers of dropped files do not say


@app.cell
def _():
    entries, set_entries = mo.state(0)  # in the fields of the muscle, counted: the fields have no names of their own

    def entered(_):
        set_entries(lambda count: count + 1)

    def sizes_of(form):
        return {key: forms.Size(*(one.value for one in three)) for key, three in form.muscle.items()}

    return entered, entries, sizes_of


@app.cell
def _(dropped, entered):
    found, form = dropped(), None
    if found is not None:
        _muscle = {
            key: tuple(
                mo.ui.text(label=label, placeholder=like, value=given, full_width=True, on_change=entered)
                for label, like, given in form_text.size_fields(key)
            )
            for key in forms.ASKED
        }
        _tests = {
            file: mo.ui.dropdown(dropping.TESTS, value=test, label="kind of test") for file, test in found.tests.items()
        }
        _columns = {
            f"{file}/{k}/{what}": mo.ui.dropdown([dropping.IGNORED, *dropping.COLUMNS], value=c.meaning, label="is")
            if what == "is"
            else mo.ui.text(value=c.unit, placeholder=forms.unit_hint(c.meaning), label="unit")
            for file, own in found.columns.items()
            for k, c in enumerate(own)
            for what in ("is", "unit")
        }
        # Not elements by a name of their own: or the button would be made anew, and a click lost, after every entry.
        # Nor `mo.ui.dictionary`: of two entries that reach a busy kernel together it keeps the second only.
        _at_rest = mo.ui.text(label=form_text.AT_REST_LABEL, placeholder=form_text.AT_REST_LIKE, full_width=True)
        form = SimpleNamespace(muscle=_muscle, tests=_tests, columns=_columns, at_rest=_at_rest)
    return form, found


@app.cell
def _(attempt, form, found, open_folder, set_told, set_wrong, sizes_of, tell_problem):
    def show_wrong(fields):
        set_wrong(fields)
        set_told(form_text.form_problem(len(fields)))

    def at_its_field(job):
        """What reading finds wrong is told at the field that it belongs to."""
        fields = {} if job.error is None else forms.field_of(found, job.error)
        if fields:
            show_wrong(fields)
        else:
            tell_problem(job)

    def describe(_):
        columns = {
            file: [tuple(form.columns[f"{file}/{k}/{what}"].value for what in ("is", "unit")) for k in range(len(own))]
            for file, own in found.columns.items()
        }
        tests = {file: one.value for file, one in form.tests.items()}
        filled = forms.Filled(sizes_of(form), tests, columns, form.at_rest.value)
        fields = forms.wrong_fields(found, filled)
        show_wrong(fields)
        folder = None if fields else attempt(lambda: forms.describe(found, forms.name_of(found), filled))
        if folder is not None:
            open_folder(Request(data=(str(folder),)), at_its_field)

    described = mo.ui.button(label="Open these data", on_change=describe)
    return (described,)


@app.cell
def _(entries, form, sizes_of):
    entries()
    mo.stop(form is None)
    mo.Html(words.heading("What the files do not say") + form_text.sketch(sizes_of(form)))
    return


@app.cell
def _(described, form, found, wrong):
    mo.stop(found is None)

    def _with_words(field, *shown):
        """Always the same elements: else the browser shows, for a moment, what was typed into one field in another."""
        said = form_text.wrong_field(wrong()[field]) if field in wrong() else ""
        return mo.vstack([*shown, mo.Html(said)], gap=0)

    _shown = [
        _with_words(_key, mo.hstack(_three, widths=[4, 1, 1], align="end")) for _key, _three in form.muscle.items()
    ]
    if found.elsewhere:
        _shown.append(_with_words(forms.AT_REST, form.at_rest))
    for _file in found.columns:
        _shown += [
            mo.Html(words.heading(_file, 3)),
            mo.Html(preview.rows_html(found.previews[_file])),
            _with_words(_file, form.tests[_file]),
        ]
        for _k, _c in enumerate(found.previews[_file]):
            _row = [form.columns[f"{_file}/{_k}/{what}"] for what in ("is", "unit")]
            _line = mo.hstack([mo.Html(preview.column_html(_c)), *_row], justify="start", wrap=True)
            _shown.append(_with_words(forms.column_field(_file, _k), _line))
    mo.vstack([*_shown, described])
    return


# ----------------------------------------------------------------------------------------------- the work under way


@app.cell
def _(work):
    clock = mo.ui.refresh(default_interval="400ms") if work() is not None else None
    off = mo.ui.button(label="Cancel", on_change=lambda _: work() and work()[0].cancel(), kind="warn")
    return clock, off


@app.cell
def _(clock, off, set_work, start, work):
    ended = None
    if clock is not None:
        clock.value
        job, then, tell_failure = work()
        if job.done:
            ended = job
            set_work(None)
            if job.problem is not None:
                tell_failure(job)
            else:
                then(job.result)
                if isinstance(job.result, bench.Session) and job.result.last.comparison is None:
                    start(Job("fitting the model", lambda tell: bench.fit_first(job.result, tell)))
    if clock is None or ended is not None:
        shown = None
    else:
        shown = mo.vstack([mo.Html(words.progress(job.words, job.share)), off, mo.Html(f"<div hidden>{clock}</div>")])
    shown
    return


@app.cell
def _(told):
    mo.callout(told(), kind="warn") if told() else None
    return


# ---------------------------------------------------------------------------------------------------- where we are


@app.cell
def _(go, session, start):
    now = session()
    last = None if now is None else now.last

    def diagnose(_):
        start(Job("the baseline", lambda tell: bench.examine(now, tell, candidates.value)))

    known = {} if now is None else words.known_effects(last)
    chosen = [label for label, name in known.items() if name in launch_options()["candidates"]]
    candidates = mo.ui.multiselect(known, value=chosen, label="Look only for", full_width=True)
    examine = mo.ui.button(label="Run the diagnosis: what is missing?", on_change=diagnose)
    undo = mo.ui.button(label="Undo", on_change=lambda _: go(bench.undo(now)))
    return candidates, examine, last, now, undo


@app.cell
def _(candidates, examine, last, now, undo):
    mo.stop(now is None)
    fitted = last.comparison is not None
    buttons = [*([examine] if fitted else []), *([undo] if len(now.steps) > 1 else [])]
    some = [mo.accordion({"Look for some effects only": candidates})] if fitted else []
    mo.vstack(
        [
            mo.Html(words.headline(now) + words.fall(now) + words.drawn_muscle(last) + words.models(now)),
            mo.hstack(buttons, justify="start", wrap=True),
            *some,
        ]
    )
    return


@app.cell
def _(last, now, start):
    def adder(name):
        called = words.called(last, name)
        return mo.ui.button(
            label=f"add {called}",
            on_change=lambda _: start(
                Job(f"adding {called}", lambda tell: bench.add(now, name.split(words.JOINT), tell))
            ),
        )

    offered = words.offers(last)
    adds = {name: adder(name) for name in offered}
    return (adds,)


@app.cell
def _(adds, last):
    mo.stop(last is None or last.diagnosis is None)
    mo.Html(words.evidence(last, adds))
    return


# ------------------------------------------------------------------------------------------- measured and model


@app.cell
def _():
    moves, set_moves = mo.state(0)  # of the sliders, counted: each is an element without a name of its own
    return moves, set_moves


@app.cell
def _():
    element = live_element()  # None where anywidget is not installed
    drawing = None if element is None else mo.ui.anywidget(element)
    return drawing, element


@app.cell
def _(element, last):
    live = None if last is None or element is None else live_of(last, element)
    frames = [] if last is None or live is not None else bench.frames_of(last)
    return frames, live


@app.cell
def _(last, live, set_moves):
    def moved(_):
        """The live picture follows at once; the still ones are drawn by a cell that counts the moves."""
        if live is None:
            set_moves(lambda count: count + 1)
        else:
            follow(last, live, {name: one.value for name, one in sliders.items()})

    def slider(handle):
        return mo.ui.slider(
            steps=list(handle.places), value=handle.start, label=handle.label, show_value=True, full_width=True,
            on_change=moved,
        )  # fmt: skip

    sliders = {} if last is None else {handle.name: slider(handle) for handle in last.laid_out.sliders}
    return (sliders,)


@app.cell
def _(drawing, last, live, sliders):
    mo.stop(last is None)
    _rows = "".join(f'<div class="slider">{element}</div>' for element in sliders.values())
    _handles = mo.Html(f'{words.heading("Measured and model")}<div class="sliders">{_rows}</div>')
    mo.vstack([mo.Html(words.STAYS), _handles, drawing, mo.md(live.left_out)]) if live is not None else _handles
    return


@app.cell
def _(frames, last, live, moves, sliders):
    moves()
    mo.stop(last is None or live is not None)
    _moved = last.laid_out.moved({name: one.value for name, one in sliders.items()})
    _loops, _error = bench.loops_of(last, frames, _moved)
    mo.Html(words.error_now(last, _error, _moved) + _loops)
    return


# ------------------------------------------------------------------------------------------------ one's own effect


@app.cell
def _(attempt, now, set_session, start):
    def define(text):
        if not text or now is None:
            return
        made = attempt(lambda: bench.define(now, text))
        if made is not None:
            set_session(made[0])
            start(Job(f"adding {made[1]}", lambda tell: bench.add(made[0], [made[1]], tell)))

    own = mo.ui.text(placeholder=EXAMPLE, label="An effect of your own, added to the pull", full_width=True).form(
        submit_button_label="Add it", on_change=define, bordered=False
    )
    return (own,)


@app.cell
def _(last, own):
    mo.stop(last is None or last.comparison is None)
    mo.vstack(
        [
            mo.Html(
                f"{words.heading('An effect of your own')}<p>One line: a force, then each parameter with unit and range. "
                f"It may name x eps v P t r alpha S F0. For example <code>{EXAMPLE}</code></p>"
            ),
            own,
        ]
    )
    return


# --------------------------------------------------------------------------------------- plan, posterior, design


@app.cell
def _(now, start):
    plan = mo.ui.button(
        label="What to measure next",
        on_change=lambda _: start(Job("planning", lambda tell: asked.plan(now, tell))),
    )
    sample = mo.ui.button(
        label="Sample what the data leave open (1 min)",
        on_change=lambda _: start(Job("sampling", lambda tell: asked.sample_posterior(now, tell))),
    )
    return plan, sample


@app.cell
def _(last, plan, sample):
    mo.stop(last is None or last.comparison is None)
    _asked = [plan, sample] if last.diagnosis is not None else [sample]
    _said = [mo.Html(words.answer_html(answer)) for answer in last.said]
    mo.vstack([mo.Html(words.heading("What else")), mo.hstack(_asked, justify="start", wrap=True), *_said])
    return


@app.cell
def _(set_drawn, start):
    def design(text):
        if text:
            start(Job("designing", lambda tell: asked.find_design(text, tell)), set_drawn)

    spec = mo.ui.text_area(value=words.DESIGN, label="What is asked for", rows=20, full_width=True).form(
        submit_button_label="Design a muscle", on_change=design, bordered=False
    )
    return (spec,)


@app.cell
def _():
    drawn, set_drawn = mo.state(None)
    return drawn, set_drawn


@app.cell
def _(drawn, spec):
    mo.vstack([mo.accordion({"Design a muscle": spec}), mo.Html("" if drawn() is None else words.answer_html(drawn()))])
    return


# ------------------------------------------------------------------------------------------------------- take it home


@app.cell
def _(last, now):
    mo.stop(last is None or last.comparison is None)
    takes = [
        mo.download(lambda: home.model_text(now).encode(), "model.toml", label="model.toml"),
        mo.download(lambda: home.report_text(now).encode(), "report.html", label="report page"),
        mo.download(lambda: home.script_text(now).encode(), "session.py", label="session as a script"),
    ]  # as bytes: text would be taken for an address
    if home.muscle_text(now) is not None:
        takes.append(mo.download(lambda: home.muscle_text(now).encode(), "muscle.toml", label="muscle.toml"))
    _citing = mo.accordion({"How to cite": mo.Html(words.citing(last))})
    mo.vstack([mo.Html(words.heading("Take it home")), mo.hstack(takes, justify="start", wrap=True), _citing])
    return


@app.cell
def _():
    if not mo.running_in_notebook():
        print(words.as_script(sys.argv[1] if len(sys.argv) > 1 else None))
    return


if __name__ == "__main__":
    app.run()
