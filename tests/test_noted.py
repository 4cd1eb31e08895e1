"""What reading the data noted is said once, and of the data set as a whole where that decides."""

from click.testing import CliRunner
from folders import folder_of, release_columns, table
from small_muscle import loops, write

from fitting import read_experiment
from fitting.cli.main import main
from fitting.recordings.noted import notes_of


def several(folder, **rows):
    """A data set of a file for each name."""
    write(folder, next(iter(rows.values())))
    toml = (folder / "muscle.toml").read_text().split("[[recording]]")[0]
    for name, each in rows.items():
        write(folder, each)
        (folder / "loops.csv").rename(folder / f"{name}.csv")
        toml += f'[[recording]]\nfile = "{name}.csv"\ntest = "loop"\n'
    (folder / "muscle.toml").write_text(toml)
    return folder


def at(pressure, **more):
    return loops(pressures=(pressure,), **more)


def test_one_pressure_a_file_is_not_one_pressure(tmp_path):
    one = several(tmp_path / "one", first=at(2e5), second=at(2e5, repeats=1))
    two = several(tmp_path / "two", first=at(2e5), second=at(3e5))
    assert [n for n in notes_of([read_experiment(one)]) if "one pressure only, 200 kPa" in n]
    assert not [n for n in notes_of([read_experiment(two)]) if "one pressure" in n]


def test_the_way_back_may_stand_in_a_file_of_its_own(tmp_path):
    rows = at(2e5, repeats=1)
    turn = max(range(len(rows)), key=lambda k: rows[k][3])
    there = several(tmp_path / "there", first=rows[: turn + 1])
    both = several(tmp_path / "both", first=rows[: turn + 1], back=rows[turn:])
    assert any("was recorded: friction cannot be told" in note for note in notes_of([read_experiment(there)]))
    assert not any("was recorded: friction cannot be told" in note for note in notes_of([read_experiment(both)]))


def test_what_files_have_in_common_is_said_once(tmp_path):
    folder = several(tmp_path / "m", a1=at(1e5), b2=at(2e5, points=80), c3=at(3e5, repeats=1))
    notes = notes_of([read_experiment(folder)])
    assert len(notes) == len(set(notes))
    speeds = [note for note in notes if "speed derived from the position" in note]
    assert speeds == ["every file: speed derived from the position by local parabolas that stop at turning points"]
    (weightless,) = (note for note in notes if "carry no weight" in note)
    lost = [sum(r.runs[0].weight == 0) for r in read_experiment(folder).recordings]
    total = [len(r.runs[0]) for r in read_experiment(folder).recordings]
    assert f"{min(lost)} to {max(lost)} of {min(total)} to {max(total)} samples carry no weight" in weightless


def test_what_stands_in_a_row_is_said_of_its_file(tmp_path):
    folder = several(tmp_path / "m", a=at(1e5), b=at(2e5))
    for name, row in (("a", 20), ("b", 30)):
        file = folder / f"{name}.csv"
        lines = file.read_text().splitlines()
        lines[row - 1] = lines[row - 1].rsplit(",", 1)[0] + ","
        file.write_text("\n".join(lines) + "\n")
    notes = notes_of([read_experiment(folder)])
    assert [n[0] for n in notes if "no reading in" in n] == ["a", "b"]
    assert any(n.startswith("a.csv: ") and n.endswith("(row 20)") for n in notes)
    assert any(n.startswith("b.csv: ") and n.endswith("(row 30)") for n in notes)


def test_data_sets_and_many_files_are_named(tmp_path):
    pressures = {f"f{k}": at(1e5 + 4e4 * k, repeats=1) for k in range(5)}
    pressures["last"] = loops(pressures=(3e5, 4e5), repeats=1)
    folder, other = several(tmp_path / "m", **pressures), write(tmp_path / "other", at(2e5))
    notes = notes_of([read_experiment(folder), read_experiment(other)])
    assert any(n.startswith("Small muscle, f0.csv, f1.csv and 3 more files: ") for n in notes), notes
    assert any(n.startswith("Small muscle, every file: ") for n in notes)
    assert any(n.startswith("Small muscle: one pressure only") for n in notes)
    assert any(n.startswith("Small muscle, loops.csv: ") for n in notes)


def test_the_commands_say_the_same(tmp_path):
    folder = several(tmp_path / "m", a=at(2e5), b=at(3e5))
    said = " ".join(CliRunner().invoke(main, ["compare", str(folder), "--baseline"]).output.split())
    for note in notes_of([read_experiment(folder)]):
        assert note in said
    assert "one pressure" not in said


def test_a_release_is_made_at_one_pressure(tmp_path):
    folder = folder_of(tmp_path, table(release_columns()), test="quick release")
    assert not any("one pressure" in note for note in notes_of([read_experiment(folder)]))


def test_muscles_that_are_stated_alike_may_be_one(tmp_path):
    """A geometry for each folder: a newcomer who had put every loop into one of its own was not told."""
    first, second = (read_experiment(write(tmp_path / name, at(2e5), name=name)) for name in ("first", "second"))
    toml = (tmp_path / "second" / "muscle.toml").read_text().replace("250 mm", "260 mm")
    (tmp_path / "second" / "muscle.toml").write_text(toml)
    longer = read_experiment(tmp_path / "second")
    assert any(n.startswith("first, second: the same sizes are stated") for n in notes_of([first, second]))
    assert not any("the same sizes" in n for n in [*notes_of([first, longer]), *notes_of([first])])
