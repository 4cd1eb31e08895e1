"""The workbench: its actions without a browser, and the whole loop with one."""

import ast
import os
import re
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request

import jax.numpy as jnp
import numpy as np
import pytest
from browser import Watched, browser, violations
from small_muscle import LENGTH, loops, write

from fitting.console.options import Asked
from fitting.errors import InputError
from fitting.reading.model_file import read_model
from fitting.reading.own_effects import library
from fitting.workbench import data as dropping
from fitting.workbench import session as bench
from fitting.workbench.job import Job
from fitting.workbench.serving import is_loopback, is_own, listening
from fitting.workbench.words import evidence, headline, offered

CANDIDATES = ("linear_spring", "viscous_damping")
COMMAND = (sys.executable, "-m", "fitting.cli", "workbench", "--no-browser")
STIFFNESS = 1600.0  # N/m, what is hidden in the data of these tests


def told(*_):
    """Progress that nobody looks at."""


def spring(eps, *_):
    return STIFFNESS * LENGTH * eps


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Loops of a muscle with a spring that the baseline does not know."""
    return write(tmp_path_factory.mktemp("spring"), loops(spring, points=40, repeats=4))


@pytest.fixture(scope="module")
def session(folder):
    """The data opened and fitted."""
    return bench.begun(bench.opened(Asked(data=(str(folder),), starts=2)), told)


@pytest.fixture(scope="module")
def found(session):
    """The session with its diagnosis."""
    return bench.examined(session, told, CANDIDATES)


@pytest.fixture(scope="module")
def mended(found):
    """The session with the spring added."""
    return bench.added(found, ["linear_spring"], told)


# ------------------------------------------------------------------------------------------------------ the actions


def test_there_is_a_picture_before_anything_is_fitted(folder):
    step = bench.opened(Asked(data=(str(folder),))).last
    assert step.comparison is None
    picture, error = bench.loops_of(step, bench.frames_of(step), {})
    assert picture.count("<figure>") == 3
    assert error > 0


def test_the_error_falls_when_what_is_missing_is_added(found, mended):
    assert found.last.diagnosis.verdict == "missing"
    assert offered(found.last)[0] == "linear_spring"
    assert mended.last.comparison.rmse < 1.2 * 0.3 < 5 * 0.3 < found.last.comparison.rmse
    assert mended.last.fit.values["linear_spring.K"] == pytest.approx(STIFFNESS, rel=0.1)
    assert [stage.added for stage in mended.stages] == ["the model as it is", "+ linear_spring"]


def test_undo_goes_back_and_changes_nothing_else(found, mended):
    assert bench.undone(mended) == found
    assert bench.undone(bench.undone(found)).steps == found.steps[:1]


def test_dropping_takes_an_effect_out_again(mended, session):
    without = bench.dropped(mended, ["linear_spring"], told)
    assert without.last.comparison.rmse == pytest.approx(session.last.comparison.rmse, rel=1e-3)


def test_a_line_defines_an_effect_that_can_be_added(session):
    line = "bung = -K*x, K = 1 N/mm (0..20)"
    defined, name = bench.defined(session, line)
    assert name == "bung"
    after = bench.added(defined, [name], told)
    assert after.last.fit.values["bung.K"] == pytest.approx(STIFFNESS, rel=0.1)
    assert line in bench.script_text(after)


@pytest.mark.parametrize("line", ["bung = __import__('os').system('x')", "bung = K*x, K = 1 N (0..20)", "nothing"])
def test_a_line_that_is_no_force_is_refused(session, line):
    with pytest.raises(InputError):
        bench.defined(session, line)


def test_words_tell_verdict_and_evidence(found):
    assert "linear_spring is missing." in headline(found)
    table = evidence(found.last, {name: f"<button>{name}</button>" for name in offered(found.last)})
    assert "explains the data" in table
    assert "<button>linear_spring</button>" in table


# ------------------------------------------------------------------------------------------------------- the sliders


def test_the_loop_follows_a_slider_as_the_model_says(session):
    step = session.last
    slider = next(s for s in step.laid_out.sliders if s.name == "muscle.radius")
    place = slider.places[0]
    moved = step.laid_out.moved({s.name: s.start for s in step.laid_out.sliders} | {"muscle.radius": place})
    assert moved == {"muscle.radius": place * slider.size}
    vector = step.fit.vector.copy()
    vector[step.fit.layout.names.index("muscle.radius")] = place * slider.size
    model = step.fit.layout.model(jnp.asarray(vector))
    force = np.asarray(model.force(step.fit.problem.blocks[0].states)).reshape(-1)
    expected = force[np.asarray(step.fit.problem.blocks[0].keep)] - step.laid_out.samples.measured
    np.testing.assert_allclose(step.laid_out.residual(moved), expected, rtol=1e-9, atol=1e-9)


def test_nothing_moved_is_the_fit(session):
    np.testing.assert_allclose(session.last.laid_out.residual(), session.last.fit.residual, rtol=1e-9, atol=1e-9)
    starts = {s.name: s.start for s in session.last.laid_out.sliders}
    assert session.last.laid_out.moved(starts) == {}


def test_every_slider_holds_its_fitted_value_and_stays_in_range(mended):
    for slider in mended.last.laid_out.sliders:
        entry = mended.last.fit.layout.entries[mended.last.fit.layout.names.index(slider.name)]
        assert slider.start in slider.places
        assert list(slider.places) == sorted(slider.places)
        assert slider.places[0] * slider.size >= entry.lower - 1e-4 * abs(entry.lower)
        assert slider.places[-1] * slider.size <= entry.upper + 1e-4 * abs(entry.upper)


def test_ten_thousand_samples_are_redrawn_at_once(tmp_path):
    folder = write(tmp_path, loops(points=420, repeats=4))
    step = bench.opened(Asked(data=(str(folder),))).last
    assert len(step.laid_out.samples) > 9800
    frames, seconds = bench.frames_of(step), []
    value = step.laid_out.vector[step.laid_out.layout.names.index("muscle.radius")]
    for k in range(30):
        begun = time.process_time()  # of all threads: what else the machine does is not counted
        picture, _ = bench.loops_of(step, frames, {"muscle.radius": value * (1 + 1e-3 * k)})
        seconds.append(time.process_time() - begun)
    assert np.median(seconds) < 0.15
    assert len(picture) < 400_000


# --------------------------------------------------------------------------------------------------------- downloads


def test_the_model_can_be_taken_home(mended, tmp_path):
    path = tmp_path / "model.toml"
    path.write_text(bench.model_text(mended))
    stored = read_model(path, library())
    assert stored.values["linear_spring.K"] == pytest.approx(mended.last.fit.values["linear_spring.K"])


def test_the_report_shows_every_step(mended):
    text = bench.report_text(mended)
    assert 'id="step0"' in text
    assert 'id="step1" checked' in text
    assert '<g class="model m1">' in text


def test_before_the_first_fit_there_is_nothing_to_take_home(folder):
    with pytest.raises(InputError, match="nothing was fitted"):
        bench.model_text(bench.opened(Asked(data=(str(folder),))))


def test_the_script_is_python_that_names_every_command(mended):
    text = bench.script_text(mended)
    commands = ast.literal_eval(re.search(r"COMMANDS = (\[.*?\n\])", text, re.DOTALL)[1])
    assert [command[0] for command in commands] == ["fit", "diagnose", "add", "report"]
    assert "linear_spring" in commands[2]
    ast.parse(text)


@pytest.mark.slow
def test_the_script_gives_the_same_model(mended, tmp_path):
    (tmp_path / "session.py").write_text(bench.script_text(mended))
    ended = subprocess.run([sys.executable, "session.py"], cwd=tmp_path, capture_output=True, text=True, timeout=900)
    assert ended.returncode == 0, ended.stderr
    stored = read_model(tmp_path / "session_model_1.toml", library())
    assert stored.values["linear_spring.K"] == pytest.approx(mended.last.fit.values["linear_spring.K"], rel=1e-3)


# ------------------------------------------------------------------------------------------------------ dropped files


ODD = "t;druck;Load cell (N);pos\n" + "".join(
    f"{0.1 * k:.1f};200;{200 - 3 * abs(30 - k % 60):.1f};{abs(30 - k % 60):.2f}\n" for k in range(240)
)


def test_dropped_files_are_described_column_by_column(tmp_path):
    dropping.keep([("C:\\data\\odd.csv", ODD.encode())], tmp_path)
    assert not dropping.is_described(tmp_path)
    found = dropping.guessed(tmp_path)
    assert [(c.head, c.meaning) for c in found.columns["odd.csv"]] == [
        ("t", "time"), ("druck", "pressure"), ("Load cell (N)", "force"), ("pos", "not used"),
    ]  # fmt: skip
    muscle = {"length": "300 mm", "radius": "7.0 +/- 0.1 mm", "braid_angle": "20 deg"}
    filled = {"odd.csv": [("time", "s"), ("pressure", "kPa"), ("force", "N"), ("displacement", "mm")]}
    dropping.describe(found, "Odd", muscle, {"odd.csv": "loop"}, filled)
    run = bench.opened(Asked(data=(str(tmp_path),))).last.task.experiments[0].recordings[0].runs[0]
    assert run.pressure[0] == pytest.approx(2e5)
    assert run.contraction.max() == pytest.approx(0.1)


def test_what_is_not_filled_in_is_named(tmp_path):
    dropping.keep([("odd.csv", ODD.encode())], tmp_path)
    with pytest.raises(InputError, match="length is not filled in"):
        dropping.describe(dropping.guessed(tmp_path), "", {}, {"odd.csv": "loop"}, {"odd.csv": []})


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ([("evil.py", b"print()")], "no CSV file and no muscle.toml"),
        ([("a/x.csv", b""), ("b/x.csv", b"")], "one name"),
        ([("muscle.toml", b"")], "no CSV file among them"),
    ],
)
def test_other_files_are_not_taken(tmp_path, files, words):
    with pytest.raises(InputError, match=words):
        dropping.keep(files, tmp_path)
    assert not list(tmp_path.glob("*.py"))


def test_a_dropped_name_cannot_leave_the_folder(tmp_path):
    inner = tmp_path / "inner"
    inner.mkdir()
    dropping.keep([("../../outside.csv", ODD.encode())], inner)
    assert [path.name for path in inner.iterdir()] == ["outside.csv"]
    assert not (tmp_path / "outside.csv").exists()


def test_a_message_names_a_dropped_file_as_its_user_does():
    assert dropping.without_place("/tmp/m_1/t_2/loops.csv, row 2: no", "/tmp/m_1") == "loops.csv, row 2: no"


# --------------------------------------------------------------------------------------------------- work, and serving


def test_work_that_is_called_off_leaves_no_result():
    going, ended = threading.Event(), []

    def work(tell):
        for k in range(1000):
            tell("working", k / 1000)
            going.set()
            time.sleep(0.01)
        ended.append(True)

    job = Job("working", work)
    assert going.wait(10)
    assert 0 <= job.share < 1
    job.cancel()
    assert job.done
    assert job.wait(10).result is None
    assert not ended
    assert "Called off" in job.problem


def test_bad_input_ends_work_with_its_message():
    def work(tell):
        raise InputError("the file is empty", "x.csv", cure="begin with a header")

    assert Job("reading", work).wait(10).problem == "x.csv: the file is empty. Cure: begin with a header"


@pytest.mark.parametrize(
    ("headers", "own"),
    [
        ({b"host": b"127.0.0.1:8642"}, True),
        ({b"host": b"127.0.0.1:8642", b"origin": b"http://127.0.0.1:8642"}, True),
        ({b"host": b"127.0.0.1:8642", b"origin": b"https://elsewhere.example"}, False),
        ({b"host": b"rebound.example"}, False),
        ({}, False),
    ],
)
def test_only_its_own_page_may_talk_to_the_workbench(headers, own):
    assert is_own(headers, ("127.0.0.1", "localhost")) is own


@pytest.mark.parametrize(
    ("host", "here"),
    [("127.0.0.1", True), ("localhost", True), ("::1", True), ("0.0.0.0", False), ("lab.example", False)],
)
def test_a_host_that_others_reach_is_known(host, here):
    assert is_loopback(host) is here


def test_it_listens_to_this_machine_alone():
    with listening("127.0.0.1", None) as one:
        assert one.getsockname()[0] == "127.0.0.1"


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Served:
    """A workbench in a process of its own."""

    def __init__(self, *arguments):
        self.port = free_port()
        command = [*COMMAND, "--port", str(self.port), *arguments]
        env = {**os.environ, "PYTHONUNBUFFERED": "1"}
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=env)
        self.lines = []
        for line in self.process.stdout:
            self.lines.append(line)
            if "Ctrl+C" in line:
                break
        self.address = next(word for line in self.lines for word in line.split() if word.startswith("http://"))
        self.wait()

    def wait(self):
        for _ in range(600):
            try:
                return self.status(f"http://127.0.0.1:{self.port}/health")
            except (urllib.error.URLError, ConnectionError):
                time.sleep(0.1)
        raise AssertionError("the workbench does not answer")

    def status(self, address, **headers):
        try:
            with urllib.request.urlopen(urllib.request.Request(address, headers=headers), timeout=60) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, ""

    def end(self):
        self.process.terminate()
        self.process.wait(30)


@pytest.fixture
def serve():
    """Workbenches that end with the test."""
    pytest.importorskip("marimo")
    running = []

    def begin(*arguments):
        running.append(Served(*arguments))
        return running[-1]

    yield begin
    for one in running:
        one.end()


def test_it_listens_here_alone_unless_told_otherwise_and_then_asks_for_a_token(serve):
    here, elsewhere = serve(), serve("--host", "0.0.0.0", "--token", "s3cret")
    status, text = here.status(here.address)
    assert status == 200
    assert "McKibben" in text or "mckibben" in text
    assert here.status(here.address, Host="rebound.example")[0] == 403
    assert "access_token=s3cret" in elsewhere.address
    place = f"http://127.0.0.1:{elsewhere.port}/"
    assert "marimo-filename" not in elsewhere.status(place)[1]
    assert elsewhere.status(f"http://127.0.0.1:{elsewhere.port}/api/kernel/run")[0] in (401, 403, 405)


def test_a_port_in_use_and_a_data_set_that_is_not_there_are_said():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        for arguments, words in ((["--port", str(taken.getsockname()[1])], "cannot be listened at"),
                                 (["no_such_data"], "no such file or folder")):  # fmt: skip
            ended = subprocess.run([*COMMAND, *arguments], capture_output=True, text=True, timeout=120)
            assert ended.returncode == 2
            assert words in ended.stderr
            assert "Cure:" in ended.stderr


# ------------------------------------------------------------------------------------------------------- in a browser


def press(page, name):
    """Press a button from the keyboard."""
    button = page.get_by_role("button", name=name).first
    button.focus()
    page.keyboard.press("Enter")


def values_of_bars(page):
    return [float(re.match(r"[\d.]+", text)[0]) for text in page.locator(".fall .value").all_inner_texts()]


@pytest.mark.slow
def test_from_an_empty_page_to_an_error_that_has_fallen(serve, folder, tmp_path):
    """By keyboard alone but for the drop: bad file, good data, slider, diagnosis, add, undo, download."""
    bad = b"run,time [s],pressure [kPa],displacement [mm],force [N]\n1,0,abc,0,0\n"
    with browser() as chromium:
        served = serve("--candidates", *CANDIDATES)
        watched = Watched(chromium.new_page(viewport={"width": 1280, "height": 1600}))
        page = watched.page
        page.goto(served.address)
        upload = page.locator("input[type=file]").first
        upload.wait_for(state="attached")
        upload.set_input_files([{"name": "muscle.toml", "mimeType": "text/plain",
                                 "buffer": (folder / "muscle.toml").read_bytes()},
                                {"name": "loops.csv", "mimeType": "text/csv", "buffer": bad}])  # fmt: skip
        page.get_by_text("loops.csv, row 2").wait_for()

        upload.set_input_files([folder / "muscle.toml", folder / "loops.csv"])
        page.locator(".loops figure").first.wait_for()
        page.get_by_role("button", name="Run the diagnosis").wait_for()
        page.locator(".now", has_text="As fitted").wait_for()

        before = page.locator(".now").inner_text()
        page.get_by_role("slider").nth(1).focus()
        page.keyboard.press("ArrowLeft")
        page.locator(".now", has_text="moved").wait_for()
        assert page.locator(".now").inner_text() != before

        press(page, "Run the diagnosis")
        page.get_by_text("linear_spring is missing.").wait_for()
        press(page, "add linear_spring")
        page.locator(".fall .row").nth(1).wait_for()
        bars = values_of_bars(page)
        assert bars[1] < 0.2 * bars[0]
        found = violations(page, "color-contrast", "button-name", "label", "image-alt", "svg-img-alt")
        assert [line for line in found if "radix-" not in line] == []  # marimo's own menu button has no name

        with page.expect_download() as expected:
            page.get_by_role("link", name="model.toml").first.focus()
            page.keyboard.press("Enter")
        expected.value.save_as(tmp_path / "model.toml")
        assert "linear_spring" in (tmp_path / "model.toml").read_text()

        press(page, "Undo")
        page.locator(".fall .row").nth(1).wait_for(state="detached")
        watched.check()
