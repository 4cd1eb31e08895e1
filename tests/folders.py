"""Small data-set folders for the tests, written as people write them."""

import numpy as np

from fitting.recordings.experiment import read_experiment

MUSCLE = """name = "Braid"
[muscle]
length = "300 mm"
radius = "7.0 +/- 0.1 mm"
braid_angle = "20 +/- 0.5 deg"
"""


def recording(test="loop", more="", file="data.csv"):
    return f'{MUSCLE}\n[[recording]]\nfile = "{file}"\ntest = "{test}"\n{more}\n'


def folder_of(path, csv=None, toml=None, test="loop", more="", encoding="utf-8"):
    (path / "muscle.toml").write_text(recording(test, more) if toml is None else toml, encoding="utf-8")
    if csv is not None:
        (path / "data.csv").write_bytes(csv if isinstance(csv, bytes) else csv.encode(encoding))
    return path


def model_beside(folder, state="fixed", **sizes):
    """The path of a model file that says it was fitted to a folder's data, with these sizes of its muscle."""
    sha = read_experiment(folder).sha256
    told = "".join(f'{name} = {{value = "{value}", state = "{state}"}}\n' for name, value in sizes.items())
    text = f'format = 1\n[muscle]\n{told}[[effect]]\nname = "ideal_cylinder"\n'
    (folder / "model.toml").write_text(f'{text}[fitted_to]\ndata = {{"{folder.name}" = "{sha}"}}\n', encoding="utf-8")
    return str(folder / "model.toml")


def table(columns, separator=",", decimal="."):
    """CSV text of these columns."""
    names, values = list(columns), [np.atleast_1d(v) for v in columns.values()]
    count = max(map(len, values))
    cells = [v if len(v) == count else np.repeat(v, count) for v in values]
    lines = [separator.join(names)]
    for row in zip(*cells, strict=True):
        lines.append(separator.join(str(cell).replace(".", decimal) for cell in row))
    return "\n".join(lines) + "\n"


def loop_columns(count=101, loops=2):
    time = np.arange(count * loops) * 0.1
    contraction = 0.1 * (1 - np.cos(2 * np.pi * np.arange(count * loops) / count))
    return {
        "time [s]": np.round(time, 3),
        "pressure [bar]": 2.0,
        "contraction [%]": np.round(100 * contraction, 5),
        "force [N]": np.round(200 - 800 * contraction, 4),
    }


def loop_csv(**changes):
    columns = loop_columns()
    for name, value in changes.items():
        columns[next(head for head in columns if head.startswith(name))] = value
    return table(columns)


def only_run(folder):
    (found,) = read_experiment(folder).recordings
    (run,) = found.runs
    return found, run


def isometric_columns(lengths=(300, 280, 260), count=80):
    pressure = np.concatenate([np.linspace(5, 500, count), np.linspace(500, 5, count)])
    time = np.arange(2 * count * len(lengths)) * 0.05
    return {
        "time [s]": np.round(time, 3),
        "pressure [kPa]": np.tile(pressure, len(lengths)),
        "length [mm]": np.repeat(lengths, 2 * count),
        "force [N]": np.tile(pressure, len(lengths)) * 0.5,
    }


def release_columns(load="load [kg]"):
    time = np.round(np.arange(-20, 200) * 0.002, 4)
    shortening = np.where(time < 0, 0, 60 * (1 - np.exp(-np.clip(time, 0, None) / 0.03)))
    return {"time [s]": time, "pressure [bar]": 3.0, "displacement [mm]": np.round(shortening, 4), load: 20.0}


def muscle_with(**changes):
    values = {"length": '"300 mm"', "radius": '"7 mm"', "braid_angle": '"20 deg"'} | changes
    return "[muscle]\n" + "\n".join(f"{key} = {value}" for key, value in values.items() if value is not None)
