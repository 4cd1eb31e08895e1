"""Many data sets, each on its own: which they are, what is written, gone on with, and shared out over a cluster."""

import json
import os
import signal
from types import SimpleNamespace

import jax
import pandas as pd
import pytest
from click.testing import CliRunner
from small_muscle import loops, write

from fitting.cli.each.run import each, here, on
from fitting.cli.each.work import Order
from fitting.cli.main import main
from fitting.errors import InputError
from fitting.study.data_sets import data_sets
from fitting.study.request import Request

MISSING = (0.0, 100.0, 200.0, 300.0)  # N per contraction of an elastic pull: one muscle differs from the next


@pytest.fixture(scope="module")
def line(tmp_path_factory):
    """A production line's muscles, one of which cannot be read, and a file that is none."""
    folder = tmp_path_factory.mktemp("line")
    for number, stiff in enumerate(MISSING):
        write(folder / f"m{number}", loops(lambda eps, *_, k=stiff: k * eps, points=20, repeats=2, seed=number))
    bad = write(folder / "bad", loops(points=20, repeats=2))
    (bad / "loops.csv").write_text((bad / "loops.csv").read_text().replace("0,0.100", "0,later", 1))
    (folder / "notes.txt").write_text("Monday\n")
    return folder


def run(*args, status=0):
    result = CliRunner().invoke(main, [str(arg) for arg in args])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == status, result.output + result.stderr
    return result


def told(folder, name):
    return json.loads((folder / f"{name}.json").read_text())["result"]


# Which they are ------------------------------------------------------------------------------------------------------


def test_a_pattern_finds_data_sets_and_passes_by_the_rest(line):
    found = data_sets([f"{line}/*"])
    assert [one.name for one in found.sets] == ["bad", "m0", "m1", "m2", "m3"]
    assert found.passed_by == 1


def test_a_data_set_counts_once_however_it_is_named(line):
    assert len(data_sets([f"{line}/m*", str(line / "m1"), f"{line}/../{line.name}/m1"]).sets) == len(MISSING)


def test_names_of_files_differ(tmp_path):
    for place in ("monday/a", "monday/b", "monday/c", "tuesday/a", "tuesday/b"):
        (tmp_path / place).mkdir(parents=True)
        (tmp_path / place / "muscle.toml").touch()
    found = data_sets([f"{tmp_path}/*/*"])
    assert [one.name for one in found.sets] == ["monday_a", "monday_b", "c", "tuesday_a", "tuesday_b"]


def test_a_pattern_that_finds_nothing_is_refused(line):
    with pytest.raises(InputError, match="finds no data sets"):
        data_sets([f"{line}/x*"])


# What is written -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def fitted(line, tmp_path_factory):
    """The line as fitted by the command, and what it said."""
    out = tmp_path_factory.mktemp("out") / "results"
    return out, run("fit", f"{line}/*", "--each", "--out", out, "--starts", "1", status=3)


def test_every_muscle_has_what_a_fit_of_its_own_gives(line, fitted, tmp_path):
    out, _ = fitted
    for name in ("m0", "m3"):
        run("fit", line / name, "--starts", "1", "--save", tmp_path / "m.toml", "--json", tmp_path / "m.json")
        alone = json.loads((tmp_path / "m.json").read_text())
        assert told(out, name)["parameters"] == alone["parameters"]
        assert told(out, name)["rmse_N"] == alone["rmse_N"]
        assert (out / f"{name}.toml").read_text() == (tmp_path / "m.toml").read_text()


def test_the_data_are_left_as_they_were(line, fitted):
    assert not list(line.rglob("model.toml"))


def test_a_bad_data_set_costs_itself_and_says_why(fitted):
    out, said = fitted
    error = told(out, "bad")["error"]
    assert error["value"] == "later"
    assert error["file"].endswith("loops.csv")
    assert "4 fitted, 1 cannot be used" in said.output
    assert error["message"].split(".")[0] in " ".join(said.output.split())
    assert not (out / "bad.toml").exists()


def test_the_table_has_a_row_for_each(fitted):
    out, _ = fitted
    rows = pd.read_csv(out / "table.csv").set_index("data set")
    assert list(rows.index) == ["bad", "m0", "m1", "m2", "m3"]
    assert rows["outcome"].to_dict() == dict.fromkeys(rows.index, "fitted") | {"bad": "cannot be used"}
    errors = rows["rmse [N]"].drop("bad")
    assert errors.is_monotonic_increasing  # the more is missing, the worse the fit
    assert errors["m0"] == pytest.approx(told(out, "m0")["rmse_N"])
    assert rows["coulomb_friction.f_s [1]"]["m1"] == told(out, "m1")["parameters"]["coulomb_friction.f_s"]["value"]


def test_diagnoses_of_a_line(line, tmp_path):
    args = ("--candidates", "linear_spring", "constant_friction", "--each", "--out", tmp_path)
    said = run("diagnose", line / "m0", line / "m3", *args, "--json", tmp_path / "r.json")
    assert told(tmp_path, "m3")["explanations"] == [["linear_spring"]]
    assert "Spring in parallel (linear_spring): 1" in said.output
    found = json.loads((tmp_path / "r.json").read_text())
    assert [one["outcome"] for one in found["data_sets"]] == [told(tmp_path, name)["verdict"] for name in ("m0", "m3")]


REFUSED = {
    "a model file": (("--each", "--save", "m.toml"), "leave --save out"),
    "a folder for one": (("--out", "x"), "add --each"),
    "own code on workers": (("--scheduler", "tcp://127.0.0.1:9", "--effect-file", "e.py"), "--define"),
    "nobody there": (("--scheduler", "tcp://127.0.0.1:9"), "no Dask scheduler answers"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_is_refused_with_a_cure(line, case, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("fitting.cli.cluster.scheduler.ANSWERS", "1s")
    more, message = REFUSED[case]
    said = run("fit", line / "m0", *more, status=2).stderr
    assert message in said
    assert said.count("\n") == 1


def test_where_nothing_can_be_used_the_status_says_so(line, tmp_path):
    run("fit", line / "bad", "--each", "--out", tmp_path, status=2)


# Gone on with --------------------------------------------------------------------------------------------------------

ORDER = Order("fit")


def all_of(line, place, work=None, names="m*", **more):
    """Fit the line's muscles."""
    with jax.enable_x64(True):
        return each(data_sets([f"{line}/{names}"]).sets, Request(starts=1, **more), ORDER, place, work)


class Cut(Exception):
    """The power fails."""


def cut_after(count):
    def work(jobs):
        for done, found in enumerate(here(jobs)):
            if done == count:
                raise Cut
            yield found

    return work


def test_a_line_that_was_cut_goes_on(line, tmp_path):
    with pytest.raises(Cut):
        all_of(line, tmp_path, cut_after(2))
    rest = all_of(line, tmp_path)
    assert rest.computed == len(MISSING) - 2
    assert len(pd.read_csv(tmp_path / "table.csv")) == len(MISSING)
    assert all_of(line, tmp_path).computed == 0


def test_only_what_changed_is_done_again(line, tmp_path):
    again = tmp_path / "line"
    for name in ("m0", "m1"):
        (again / name).mkdir(parents=True)
        for file in (line / name).iterdir():
            (again / name / file.name).write_bytes(file.read_bytes())
    first = all_of(again, tmp_path / "out")
    (again / "m1" / "loops.csv").write_bytes((line / "m3" / "loops.csv").read_bytes())
    second = all_of(again, tmp_path / "out")
    assert second.computed == 1
    assert second.results[0]["parameters"] == first.results[0]["parameters"]
    assert second.results[1]["rmse_N"] > 1.5 * first.results[1]["rmse_N"]
    assert all_of(again, tmp_path / "out", fix=("coulomb_friction.f_s",)).computed == 2


def test_a_bad_data_set_is_tried_again(line, tmp_path):
    assert all_of(line, tmp_path, names="bad").computed == 0
    assert all_of(line, tmp_path, names="bad").results[0]["error"]["value"] == "later"


def test_a_model_that_another_order_wrote_beside_a_result_is_done_again(line, tmp_path):
    """As two commands at once leave it: the result of the one, the model of the other."""
    all_of(line, tmp_path, names="m1")
    ours, model = (tmp_path / "m1.json").read_bytes(), (tmp_path / "m1.toml").read_bytes()
    all_of(line, tmp_path, names="m1", fix=("coulomb_friction.f_s",))
    (tmp_path / "m1.json").write_bytes(ours)
    assert all_of(line, tmp_path, names="m1").computed == 1
    assert (tmp_path / "m1.toml").read_bytes() == model
    assert all_of(line, tmp_path, names="m1").computed == 0


def test_models_that_were_not_wanted_at_first_are_written_when_they_are(line, tmp_path):
    """--no-save, then the same command without it."""
    first = all_of(line, tmp_path, names="m1", no_save=True)
    assert not list(tmp_path.glob("*.toml"))
    assert all_of(line, tmp_path, names="m1", no_save=True).computed == 0
    again = all_of(line, tmp_path, names="m1")
    assert again.computed == 1
    assert again.results[0]["parameters"] == first.results[0]["parameters"]
    assert (tmp_path / "m1.toml").is_file()
    assert all_of(line, tmp_path, names="m1").computed == 0


def test_models_that_are_there_are_left_alone_where_none_are_wanted(line, tmp_path):
    all_of(line, tmp_path, names="m1")
    model = (tmp_path / "m1.toml").read_bytes()
    assert all_of(line, tmp_path, names="m1", no_save=True).computed == 0
    assert all_of(line, tmp_path, names="m1", no_save=True, fix=("coulomb_friction.f_s",)).computed == 1
    assert (tmp_path / "m1.toml").read_bytes() == model
    assert all_of(line, tmp_path, names="m1", fix=("coulomb_friction.f_s",)).computed == 1  # that is another order's
    assert (tmp_path / "m1.toml").read_bytes() != model


# On a cluster --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with distributed.LocalCluster(**options) as running:
        yield running


SPRING = "spring = K*x, K = 500 N/m (0..9000)"


def test_a_killed_worker_loses_and_doubles_nothing(line, cluster, tmp_path):
    """Also: what a line defines goes along, and a data set that cannot be read costs none but itself."""
    more = {"define": (SPRING,), "effects": ("ideal_cylinder", "coulomb_friction", "spring")}
    here_first = all_of(line, tmp_path / "here", names="*", **more)
    victim = next(iter(cluster.workers.values())).pid
    given, killed = [], on(cluster.scheduler_address)

    def work(jobs):
        for one, found in killed(jobs):
            given.append(one.name)
            if len(given) == 1:
                os.kill(victim, signal.SIGKILL)
            yield one, found

    there = all_of(line, tmp_path / "there", work, names="*", **more)
    assert sorted(given) == ["m0", "m1", "m2", "m3"]
    assert there.results[0]["error"] == here_first.results[0]["error"]
    for mine, theirs in zip(here_first.results[1:], there.results[1:], strict=True):
        assert mine["parameters"].keys() == theirs["parameters"].keys()
        for name, value in mine["parameters"].items():
            assert theirs["parameters"][name]["value"] == pytest.approx(value["value"], rel=1e-9)
    assert {f.name for f in (tmp_path / "there").iterdir()} == {f.name for f in (tmp_path / "here").iterdir()}


def ends_its_worker(name):
    """A piece of work that one name does not survive."""
    if name == "deadly":
        os._exit(1)
    return name.upper()


def test_work_that_kills_its_workers_costs_itself_alone():
    distributed, dask = pytest.importorskip("distributed"), pytest.importorskip("dask")
    from fitting.cli.cluster.scheduler import connect, spread

    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with dask.config.set({"distributed.scheduler.allowed-failures": 1}), distributed.LocalCluster(**options) as running:
        client = connect(running.scheduler_address)
        pieces = [(name, (name,)) for name in ("a", "deadly", "b", "c", "d", "e")]
        ends = {name: (found, error) for name, found, error in spread(client, ends_its_worker, pieces)}
    assert ends.keys() == {name for name, _ in pieces}
    assert "KilledWorker" in type(ends["deadly"][1]).__name__
    for name in "abcde":
        assert ends[name] == (name.upper(), None)


def test_a_result_that_died_with_its_worker_is_waited_for():
    """A piece that was done is pending again when the only worker that had its result is gone."""
    pytest.importorskip("distributed")
    from fitting.cli.cluster.scheduler import outcome

    running = SimpleNamespace(status="running")
    again = SimpleNamespace(status="pending", result=lambda: "B", exception=lambda: None)
    assert outcome(running, again) == ("B", None)


def test_a_scheduler_that_is_lost_is_no_fault_of_the_data():
    distributed = pytest.importorskip("distributed")
    from fitting.cli.cluster.scheduler import connect, spread

    running = distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None)
    pieces = ((number, (number,)) for number in range(1000))
    begun = spread(connect(running.scheduler_address), abs, pieces)
    assert next(begun)[2] is None
    running.close()
    with pytest.raises(InputError, match="scheduler was lost"):
        list(begun)
