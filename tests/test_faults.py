"""What survives a kill, a full disk, a second writer and a damaged folder; the table of it stands in the how-to."""

import ast
import multiprocessing
import os
import resource
import signal
import sqlite3
import subprocess
import sys
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner
from small_muscle import loops, write

from fitting.cli.main import main
from fitting.errors import InputError
from fitting.least_squares.fit import fit
from fitting.model_files.writer import is_edited, write_model
from fitting.posterior.sample import sample
from fitting.posterior.store import copy_store
from fitting.recordings.experiment import read_experiment
from fitting.recordings.template import write_muscle_file
from fitting.report.results import write_json
from fitting.study.request import CHAINS
from fitting.workbench.data import keep
from fitting.writing import write_replacing, write_text
from mckibben_jax.effects import CoulombFriction, IdealCylinder
from tests.test_posterior import straight_line

ROOT = Path(__file__).parents[1]
OLD, LONG = "the old text\n", "a long text\n" * 20_000


@contextmanager
def full_disk(limit=50_000):
    """A limit on the size of files stands for the full disk: writing fails in the same place."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    previous = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, previous)


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """Loops of a small muscle, and the baseline fitted to them."""
    folder = write(tmp_path_factory.mktemp("faults") / "small", loops(points=30, repeats=2))
    return folder, fit([read_experiment(folder)], [IdealCylinder(), CoulombFriction()], starts=1)


# ---------------------------------------------------------------------------------------------------------- one file


def half_then(end):
    """Writes half of a file, then meets its end."""

    def write(new):
        with new.open("w") as file:
            file.write(LONG)
            file.flush()
            end()

    return write


def killed():
    os.kill(os.getpid(), signal.SIGKILL)


def interrupted():
    raise KeyboardInterrupt


def killed_while_writing(path):
    write_replacing(path, half_then(killed))


def test_a_kill_while_a_file_is_written_leaves_the_old_one(tmp_path):
    path = tmp_path / "result.json"
    path.write_text(OLD)
    child = multiprocessing.get_context("fork").Process(target=killed_while_writing, args=(path,))
    child.start()
    child.join()
    assert child.exitcode == -signal.SIGKILL
    assert path.read_text() == OLD
    assert [other.name for other in tmp_path.iterdir() if not other.name.startswith(".")] == ["result.json"]


def test_ctrl_c_while_a_file_is_written_leaves_the_old_one_and_nothing_else(tmp_path):
    path = tmp_path / "result.json"
    path.write_text(OLD)
    with pytest.raises(KeyboardInterrupt):
        write_replacing(path, half_then(interrupted))
    assert path.read_text() == OLD
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_leaves_the_old_file_and_is_said_with_its_cure(tmp_path):
    path = tmp_path / "result.json"
    path.write_text(OLD)
    with full_disk(), pytest.raises(InputError, match="cannot be written") as caught:
        write_json(str(path), {"numbers": list(range(50_000))})
    assert "make room" in caught.value.cure
    assert path.read_text() == OLD
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_stays_a_link_and_a_file_keeps_its_rights(tmp_path):
    path, link = tmp_path / "real.txt", tmp_path / "link.txt"
    path.write_text(OLD)
    path.chmod(0o640)
    link.symlink_to(path)
    write_text(link, "new\n")
    assert link.is_symlink()
    assert path.read_text() == "new\n"
    assert path.stat().st_mode & 0o777 == 0o640


def test_a_folder_that_another_program_moves_away_is_no_device(tmp_path, monkeypatch):
    """Two commands that replace one folder: whatever the first looks at, the other moves the folder away just then."""
    place = tmp_path / "table"
    place.mkdir()
    looked = Path.stat

    def looked_once(path, **options):
        found = looked(path, **options)
        if path == place:
            place.rmdir()
        return found

    monkeypatch.setattr(Path, "stat", looked_once)
    written = []
    write_replacing(place, lambda new: (new.mkdir(), written.append(new)))
    monkeypatch.undo()
    assert place.is_dir()
    assert written != [place]


def test_a_device_is_written_to_and_not_replaced():
    write_text("/dev/null", "new\n")
    assert not Path("/dev/null").is_file()


def test_a_long_name_is_no_hindrance(tmp_path):
    path = tmp_path / ("ü" * 120 + ".json")  # 245 bytes
    write_text(path, OLD)
    assert path.read_text() == OLD


def written_again_and_again(path, letter):
    for _ in range(100):
        write_text(path, letter * 100_000)


def test_two_writers_of_one_file_never_mix(tmp_path):
    path, fork = tmp_path / "result.txt", multiprocessing.get_context("fork")
    write_text(path, "a" * 100_000)
    writers = [fork.Process(target=written_again_and_again, args=(path, letter)) for letter in "ab"]
    for writer in writers:
        writer.start()
    seen = set()
    while any(writer.is_alive() for writer in writers):
        text = path.read_text()
        assert len(text) == 100_000
        seen |= {text.count("a")}
    assert seen <= {0, 100_000}
    assert [writer.exitcode for writer in writers] == [0, 0]
    assert list(tmp_path.iterdir()) == [path]


def test_a_model_that_finds_no_room_leaves_the_one_before(small, tmp_path):
    folder, found = small
    path, data = tmp_path / "model.toml", [read_experiment(folder)]
    assert write_model(path, found, data) is None
    before = path.read_bytes()
    with full_disk(100):
        assert "cannot be written" in str(write_model(path, found, data))
    assert path.read_bytes() == before
    assert not is_edited(path)
    assert write_model(path, found, data) is None


def test_a_muscle_file_that_finds_no_room_can_be_written_again(small, tmp_path):
    (tmp_path / "loops.csv").write_bytes((small[0] / "loops.csv").read_bytes())
    with full_disk(100), pytest.raises(InputError, match="cannot be written") as caught:
        write_muscle_file(tmp_path)
    assert "make room" in caught.value.cure
    assert write_muscle_file(tmp_path).stat().st_size > 100


def test_dropped_files_that_find_no_room_are_said(tmp_path):
    with full_disk(100), pytest.raises(InputError, match="cannot be written") as caught:
        keep([("loops.csv", LONG.encode()), ("muscle.toml", b"")], tmp_path)
    assert "make room" in caught.value.cure
    assert list(tmp_path.iterdir()) == []


# ------------------------------------------------------------------------------------------------------- the commands


def command(*args, limit=None, out=subprocess.PIPE):
    """The command line in a process of its own, whose files may have so many bytes at most."""

    def limited():
        if limit is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    typed = [sys.executable, "-m", "fitting.cli", *map(str, args)]
    return subprocess.run(typed, cwd=ROOT, stdout=out, stderr=subprocess.PIPE, text=True, preexec_fn=limited)


def test_what_was_computed_is_said_before_the_disk_is_found_full(small, tmp_path):
    done = command("fit", small[0], "--starts", 1, "--no-save", "--json", tmp_path / "r.json", limit=200)
    assert done.returncode == 2, done.stderr
    assert "coulomb_friction.f_s" in done.stdout
    assert done.stderr.count("\n") == 1
    assert "make room" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_model_that_was_asked_for_and_not_saved_is_no_success(small, tmp_path):
    done = command("fit", small[0], "--starts", 1, "--save", tmp_path / "m.toml", limit=200)
    assert done.returncode == 2, done.stderr
    assert "the model is not saved" in done.stderr
    assert "Traceback" not in done.stderr


def test_words_that_find_no_room_are_no_traceback():
    with open("/dev/full", "w") as full:
        done = command("equations", "25", out=full)
    assert done.returncode != 0
    assert "Traceback" not in done.stderr
    assert "No space left" in done.stderr


def hot_journal(path):
    """Chains of two blocks, and a writer killed in the middle of the third: its pages are half in the file."""
    with closing(sqlite3.connect(path)) as file, file:
        file.execute("CREATE TABLE block (number INTEGER PRIMARY KEY, arrays BLOB)")
        file.executemany("INSERT INTO block VALUES (?, ?)", [(n, bytes([n]) * 300_000) for n in (1, 2)])
    child = os.fork()
    if not child:
        file = sqlite3.connect(path, isolation_level=None)
        file.execute("PRAGMA cache_size = 1")
        file.execute("BEGIN")
        file.execute("UPDATE block SET arrays = ?", (b"x" * 400_000,))
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(child, 0)


def test_chains_of_a_killed_run_are_read_as_they_were_before_its_last_block(tmp_path):
    kept, place = tmp_path / CHAINS, tmp_path / "place"
    place.mkdir()
    hot_journal(kept)
    assert (tmp_path / f"{CHAINS}-journal").stat().st_size > 0
    with closing(sqlite3.connect(copy_store(kept, place))) as copy:
        found = copy.execute("SELECT number, arrays FROM block ORDER BY number").fetchall()
    assert found == [(1, b"\x01" * 300_000), (2, b"\x02" * 300_000)]


def test_chains_that_cannot_be_read_cost_the_report_nothing_else(small, tmp_path):
    folder, page = tmp_path / "small", tmp_path / "page.html"
    folder.mkdir()
    for file in ("muscle.toml", "loops.csv"):
        (folder / file).write_bytes((small[0] / file).read_bytes())
    (folder / CHAINS).write_bytes(b"SQLite format 3\x00" + bytes(5000))
    done = CliRunner().invoke(main, ["report", str(folder), "--no-diagnosis", "--starts", "1", "--html", str(page)])
    assert done.exit_code == 0, done.output
    assert "cannot be read" in " ".join(done.output.split())
    assert "</html>" in page.read_text()


def test_chains_that_are_only_read_were_not_stopped_by_a_clock(tmp_path):
    """As `report` reads them: what they lack is steps, and "after 0 s" would say nothing."""
    found, experiment = straight_line()
    chains = str(tmp_path / CHAINS)
    few = {"ensembles": 2, "walkers": 8, "seed": 3, "chains": chains}
    sample(found, [experiment], max_steps=60, **few)
    told = " ".join(sample(found, [experiment], limit_s=0.0, **few).warnings)
    assert "stopped after 60 steps" in told
    assert "after 0 s" not in told


# --------------------------------------------------------------------------------------------------------- the clock


def test_nothing_hangs_on_the_clock_of_the_day():
    """Clocks go back; what waits or measures time asks the one that does not. The store of compiled programs drops its
    oldest files first, by their dates: a clock that went back costs a compilation."""
    for path in [*(ROOT / "fitting").rglob("*.py"), *(ROOT / "mckibben_jax").rglob("*.py")]:
        asked = {ast.unparse(n) for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Attribute)}
        ticking = {"time.time", "time.time_ns", "datetime.now", "datetime.datetime.now", "date.today", "time.localtime"}
        assert not asked & ticking, path
        assert path.name == "store.py" or not [name for name in asked if name.endswith(("st_mtime", "st_ctime"))]
