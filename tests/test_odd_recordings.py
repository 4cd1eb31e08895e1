"""What is odd in recordings that can be fitted is said, and what is usual is not."""

import numpy as np
import pytest
from folders import MUSCLE, folder_of, loop_columns, table

from fitting import read_experiment

LENGTH = 300.0  # mm, of the muscle


def noted(folder, words):
    experiment = read_experiment(folder)
    notes = [*experiment.notes, *(note for each in experiment.recordings for note in each.notes)]
    return [note for note in notes if words in note]


def of_durations(folder, rows):
    """A data set of one file for each of these numbers of readings, all of the same loop."""
    whole = {name: np.broadcast_to(values, 202) for name, values in loop_columns().items()}
    files = [f"loop_{k}.csv" for k in range(len(rows))]
    for k, (file, count) in enumerate(zip(files, rows, strict=True)):
        columns = {name: values[:count] for name, values in whole.items()} | {"pressure [bar]": 2.0 + k}
        (folder / file).write_text(table(columns))
    entries = "".join(f'\n[[recording]]\nfile = "{file}"\ntest = "loop"\n' for file in files)
    (folder / "muscle.toml").write_text(MUSCLE + entries)
    return folder


def test_a_run_that_ends_long_before_the_others_is_named(tmp_path):
    (note,) = noted(of_durations(tmp_path, (202, 202, 120, 202)), "lasts")
    assert note == "loop_2.csv lasts 12 s, each of the others 20 s: if it was cut off, record it again"


@pytest.mark.parametrize("rows", [(202, 202, 202), (202, 120), (202, 190, 202), (202, 120, 180, 202)])
def test_durations_that_are_alike_or_differ_by_plan_get_no_word(tmp_path, rows):
    assert noted(of_durations(tmp_path, rows), "lasts") == []


def test_a_whole_loop_that_was_faster_is_not_called_cut_off(tmp_path):
    folder = of_durations(tmp_path, (202, 202, 202, 202))
    fast = folder / "loop_3.csv"
    head, *rows = fast.read_text().splitlines()
    faster = [f"{float(row.split(',')[0]) / 3:.3f},{row.split(',', 1)[1]}" for row in rows]
    fast.write_text("\n".join([head, *faster]) + "\n")
    assert noted(folder, "lasts") == []


def pulling(least):
    """A loop that shortens by 60 mm, on which the force falls from 200 N to `least`."""
    columns = {name: np.broadcast_to(values, 202) for name, values in loop_columns().items()}
    way = columns.pop("contraction [%]") / 20.0
    told = {**columns, "force [N]": 200.0 - (200.0 - least) * way, "displacement [mm]": 60.0 * way}
    return table(told)


def test_stiff_rubber_at_low_pressure_and_a_run_without_force_are_not_asked_about(tmp_path):
    columns = {name: np.broadcast_to(values, 202) for name, values in loop_columns().items()}
    way = columns.pop("contraction [%]") / 20.0
    stiff = {**columns, "contraction [%]": 20 * way, "pressure [bar]": 0.2, "force [N]": 60.0 - 55.0 * way}
    assert noted(folder_of(tmp_path, table(stiff)), "is the muscle's length") == []
    runs = [
        {**columns, "contraction [%]": 20 * way, "run": k, "force [N]": f}
        for k, f in enumerate((200 - 120 * way, 0 * way))
    ]
    both = {name: np.concatenate([np.broadcast_to(run[name], 202) for run in runs]) for name in runs[0]}
    assert noted(folder_of(tmp_path, table(both)), "nan") == []


@pytest.mark.parametrize(("length", "least", "odd"), [(10, 20.0, True), (1, 20.0, False), (10, 150.0, False)])
def test_a_length_that_is_ten_times_too_large_is_asked_about(tmp_path, length, least, odd):
    """The force falls by nine tenths on 2 per cent; it may fall by a quarter on them, and by nine tenths on 20."""
    folder = folder_of(tmp_path, pulling(least))
    text = (folder / "muscle.toml").read_text().replace("300 mm", f"{LENGTH * length:g} mm")
    (folder / "muscle.toml").write_text(text)
    notes = noted(folder, "is the muscle's length")
    assert [f"length of {LENGTH * length:g} mm right" in note for note in notes] == ([True] if odd else [])
