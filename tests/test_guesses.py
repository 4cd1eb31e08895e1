"""What `mckibben init` takes the files of one bench for: weights that are lifted, lengths that are held."""

import numpy as np
import pytest
from folders import folder_of, only_run, table

from fitting.errors import InputError
from fitting.recordings.guesses import guesses_of
from fitting.recordings.template import muscle_file, write_guessed

RANDOM = np.random.default_rng(4)
HEADS = ("Time (s)", "p_muscle (kPa)", "Laser (mm)", "Load cell (N)")


def logged(path, pressure, place, force, errors=(0.4, 0.02, 0.3)):
    """A file as a logger writes it, every channel with its noise."""
    signals = [np.broadcast_to(each, pressure.shape) for each in (pressure, place, force)]
    read = [each + RANDOM.normal(0, error, each.size) for each, error in zip(signals, errors, strict=True)]
    columns = dict(zip(HEADS, (np.arange(pressure.size) * 0.05, *read), strict=True))
    path.write_text(table({head: np.round(values, 3) for head, values in columns.items()}))


def ramp(samples):
    """Up to 400 kPa and back."""
    return 400 * (1 - np.abs(np.linspace(-1, 1, samples)))


@pytest.mark.parametrize(("force", "test", "name"), [(98.0, "isotonic", "load"), (None, "loop", "force")])
def test_a_load_cell_that_reads_the_same_while_the_pressure_is_swept_carries_a_weight(tmp_path, force, test, name):
    pressure = ramp(800)
    logged(tmp_path / "bench.csv", pressure, 0.1 * pressure - 3, 0.5 * pressure if force is None else force)
    (guess,) = guesses_of(tmp_path)
    assert guess.test == test
    assert guess.columns == {
        "time": HEADS[0], "pressure": HEADS[1], "displacement": HEADS[2], name: HEADS[3],
    }  # fmt: skip


def test_a_force_that_stays_at_a_held_pressure_is_no_weight(tmp_path):
    logged(tmp_path / "bench.csv", np.full(800, 300.0), 20 + 10 * np.sin(np.arange(800) / 50), 98.0)
    (guess,) = guesses_of(tmp_path)
    assert guess.test == "loop"


@pytest.mark.parametrize("samples", [60, 160, 1600])
def test_a_length_that_differs_by_its_noise_is_held_however_short_the_file(tmp_path, samples):
    pressure = ramp(samples)
    logged(tmp_path / "bench.csv", pressure, 0.03, 0.5 * pressure)
    (guess,) = guesses_of(tmp_path)
    assert guess.test == "isometric"


@pytest.mark.parametrize("each", [8, 10, 16])
def test_a_loop_that_is_read_a_few_times_in_each_cycle_is_no_held_length(tmp_path, each):
    for name, place in (("sine", np.sin), ("triangle", lambda angle: np.arcsin(np.sin(angle)))):
        stroke = 15 + 15 * place(2 * np.pi * np.arange(200) / each)
        logged(tmp_path / f"{name}.csv", np.full(200, 300.0), stroke, 400 - 5 * stroke)
    assert [guess.test for guess in guesses_of(tmp_path)] == ["loop", "loop"]


def test_a_column_is_the_same_in_all_files_of_a_bench(tmp_path):
    """Held at 20 mm of shortening, a laser shows what might be a length, but for the file at 0 mm."""
    pressure = ramp(400)
    for name, place in (("a", 0.0), ("b", 20.0), ("c", 40.0)):
        logged(tmp_path / f"{name}.csv", pressure, place, 0.5 * pressure)
    assert [guess.columns["displacement"] for guess in guesses_of(tmp_path)] == [HEADS[2]] * 3
    (tmp_path / "a.csv").unlink()
    assert [guess.columns["length"] for guess in guesses_of(tmp_path)] == [HEADS[2]] * 2


def test_a_load_cell_may_read_what_hangs_on_the_muscle(tmp_path):
    pressure = 5 * (1 - np.abs(np.arange(201) / 100 - 1)) + 0.1
    columns = {"time [s]": np.arange(201) * 0.1, "pressure [bar]": pressure, "length [mm]": 300 - 10 * pressure}
    recording, run = only_run(folder_of(tmp_path, table(columns | {"force [kN]": 0.05}), test="isotonic"))
    assert run.load == pytest.approx(50.0)
    assert recording.units["N"] == "kN"


def let_go(samples=1200, back=0):
    """Place (mm) of a muscle that stands for 10 s, jumps by 10 mm and swings for long; or is led there and back."""
    time = np.arange(samples) * 0.05
    jump = 10 * (1 - np.exp(-np.maximum(time - 10, 0) / 20) * np.cos(np.maximum(time - 10, 0) * 6))
    return 20 * np.interp(time, np.linspace(0, time[-1], 2 * back + 1), [0, 1] * back + [0]) if back else jump


@pytest.mark.parametrize(("back", "test"), [(0, "quick release"), (1, "loop"), (2, "loop"), (3, "loop")])
def test_a_jump_at_a_held_pressure_is_a_release(tmp_path, back, test):
    """Loops of a bench were taken for releases, for their last quarter lies far from where they begin."""
    place = let_go(back=back)
    logged(tmp_path / "loslassen.csv", np.full(place.size, 300.0), place, np.linspace(700, 300, place.size))
    (guess,) = guesses_of(tmp_path)
    assert guess.test == test
    assert ('constant = { load = "? kg" }' in muscle_file(tmp_path)) == (test == "quick release")


def test_a_slow_ramp_to_another_length_is_no_release(tmp_path):
    place = np.clip(np.linspace(-5, 25, 1200), 0, 20)
    logged(tmp_path / "bench.csv", np.full(place.size, 300.0), place, np.linspace(700, 300, place.size))
    assert guesses_of(tmp_path)[0].test == "loop"


GERMAN = "Zeit [s];Kraft [N];Weg [mm];Druck [bar abs]\n"


@pytest.mark.parametrize("ending", [".txt", ".lvm", ".dat", ".TXT"])
def test_a_table_in_a_text_is_a_recording_and_words_are_none(tmp_path, ending):
    ramps = np.abs(np.linspace(-1, 1, 101))
    rows = [f"{0.1 * k:.2f};{700 - 300 * x:.3f};{20 * x:.3f};4,0" for k, x in enumerate(ramps)]
    (tmp_path / f"schleife{ending}").write_text(GERMAN + "\n".join(rows).replace(".", ","))
    (tmp_path / "notes.txt").write_text("Measured on Monday, 3 bar, 5 runs, by Eva.\nThe valve leaks.\n")
    (guess,) = guesses_of(tmp_path)
    assert guess.test == "loop"
    assert guess.columns == {
        "time": "Zeit [s]", "force": "Kraft [N]", "displacement": "Weg [mm]", "pressure": "Druck [bar abs]",
    }  # fmt: skip
    assert guess.readable is not None  # its unit says that it is absolute, and that can be read
    assert guess.pressure.startswith('pressure = "absolute"')


def test_a_folder_with_words_alone_has_no_recording(tmp_path):
    (tmp_path / "notes.txt").write_text("1, 2 or 3 bar?\n")
    with pytest.raises(InputError, match="no recording is in this folder"):
        write_guessed(tmp_path)


def test_a_fast_cycle_that_comes_back_is_no_release(tmp_path):
    time = 0.05 * np.arange(1200)
    place = 10 * (1 - np.cos(3 * np.maximum(time - 10, 0)))
    logged(tmp_path / "bench.csv", np.full(place.size, 300.0), place, np.linspace(700, 300, place.size))
    assert guesses_of(tmp_path)[0].test == "loop"
