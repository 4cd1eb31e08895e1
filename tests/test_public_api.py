"""The public interface does not change by accident: names, arguments, effects, commands and their options.

Adding is free: an argument with a default, an effect, a parameter, a command, an option. What stands here may be
renamed, reordered or removed only with an entry under "Breaking" in CHANGELOG.md that says what to write instead.
"""

import ast
import importlib
import inspect
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import click
import pytest

import fitting
import fitting.report
import mckibben_jax
from fitting.cli.main import COMMANDS, main
from mckibben_jax import LIBRARY, SUPPLIES, Model, name_of, parameters

NUMBERS = Path(__file__).with_name("parameters.json")
# Arguments in their order; "=" marks a default, after "*" they are given by name alone.
PYTHON = {
    "mckibben_jax.Muscle": (
        "length, radius, braid_angle, wall_thickness=, wall_outside=, shear_modulus=, mooney_c10=, "
        "mooney_c01=, strand_width=, strand_modulus=, strand_poisson=, breaking_stress=, moving_mass="
    ),
    "mckibben_jax.State": ("contraction, pressure, rate=, pressure_rate=, stretch=, stretch_rate=, time=, memory="),
    "mckibben_jax.parameter": "default, unit, meaning, range, starts=",
    "mckibben_jax.parameters": "thing",
    "mckibben_jax.name_of": "effect",
    "mckibben_jax.title_of": "effect",
    "mckibben_jax.Felt.felt": "self, muscle, state, pull",
    "mckibben_jax.Energy.energy": "self, muscle, state",
    "mckibben_jax.Energy.force": "self, muscle, state",
    "mckibben_jax.Pulling.force": "self, muscle, state",
    "mckibben_jax.Lost.lose": "self, muscle, state, loss",
    "mckibben_jax.Read.read": "self, signal, time",
    "mckibben_jax.model": "muscle, *effects",
    "mckibben_jax.contributions": "given, run",
    "mckibben_jax.with_effects": "present, added",
    "mckibben_jax.release": "model, *, load, pressure, times, start=, mass=, step=",
    "mckibben_jax.step_response": "model, *, load, pressure, times, start=, mass=, step=",
    "mckibben_jax.laws.review.lookup": "number",
    "mckibben_jax.design.Task": (
        "muscle, variables, objective, at=, constraints=, effects=, maximise=, starts=, seed="
    ),
    "mckibben_jax.design.Limit": "quantity, at=, min=, max=",
    "mckibben_jax.design.design": "task",
    "mckibben_jax.design.front": "task, second",
    "mckibben_jax.laws.braid.ideal_force": "contraction, pressure, radius, braid_angle",
    "mckibben_jax.laws.braid.contact_surface": "contraction, length, radius, braid_angle",
    "mckibben_jax.laws.braid.radius_ratio": "contraction, braid_angle",
    "mckibben_jax.laws.braid.largest_contraction": "braid_angle",
    "mckibben_jax.laws.reynolds.affine": "pressure, at_rest, per_pascal",
    "mckibben_jax.laws.reynolds.free_motion": "time, start, rest, mass, damping, stiffness",
    "mckibben_jax.laws.reynolds.rest_position": "load, contractile_force, stiffness",
    "fitting.use_64_bit": "",
    "fitting.read_experiment": "folder",
    "fitting.read_recording": "path, test, muscle, options=",
    "fitting.write_muscle_file": "folder",
    "fitting.example_data": "name",
    "fitting.sealed_truth": "name",
    "fitting.example_names": "",
    "fitting.fit": "experiments, effects, *, fix=, free=, own=, start=, starts=, seed=",
    "fitting.evaluate": "experiments, effects, values, free, own=",
    "fitting.compare": "fit, experiments",
    "fitting.diagnose": "experiments, effects, *, candidates=, fix=, free=, own=, seed=, start=, progress=",
    "fitting.discover": (
        "experiments, effects, *, candidates=, fix=, free=, own=, seed=, start=, rules=, on_step=, progress="
    ),
    "fitting.plan": "diagnosis, experiments, *, known=, fix=, free=, own=, seed=",
    "fitting.sample": (
        "fit, experiments=, *, seed=, walkers=, ensembles=, max_steps=, limit_s=, rows=, priors=, noise=, "
        "chains=, again=, progress="
    ),
    "fitting.quick_look": "fit, experiments=, *, seed=, draws=, rows=, priors=, noise=",
    "fitting.quick_releases": "experiments",
    "fitting.hill_curves": "experiments",
    "fitting.effect_from_line": "line",
    "fitting.library.library.library": "effect_file=, define=",
    "fitting.effects_named": "names, known=",
    "fitting.read_model": "path, known=",
    "fitting.write_model": "path, fit, experiments",
    "fitting.report.waterfall": "stages, floor, unit=",
    "fitting.report.effects_picture": "d, floor, unit=",
    "fitting.report.pairs": "posterior",
    "fitting.report.speed_over_load": "curves",
    "fitting.report.to_scale": "muscle, contraction, pressure",
    "fitting.baseline": "",
    "fitting.simulate": (
        "model, folder, test=, *, pressures=, turns=, speed=, contractions=, loads=, duration=, rate=, noise=, seed="
    ),
    "fitting.export": "model, file, *, contractions=, pressures=, points=, source=",
    "fitting.InputError": "problem, file=, row=, column=, value=, cure=",
}
MODEL = ("names", "force", "pull", "feel", "lost", "add", "drop", "cite")
# Parameters by effect. With "effect.parameter" they are the names of model files, options and JSON keys.
EFFECTS = {
    "pressure_offset": "P_off",
    "pressure_gain": "g",
    "contraction_offset": "eps_off",
    "supply_lag": "tau",
    "pressure_drop": "tau",
    "dead_band": "P_th",
    "radial_gap": "gap",
    "series_compliance": "k_s",
    "tip": "k",
    "tip_pressure": "b_k a_k P_k",
    "strand_stretch": "EA",
    "ideal_cylinder": "",
    "conical_ends": "k_c",
    "reduced_length": "factor",
    "bladder_neo_hookean": "G",
    "bladder_mooney_rivlin": "C10 C01",
    "bladder_ogden": "G n",
    "bladder_thin_mooney_rivlin": "C10 C01",
    "bladder_schulte": "k_e",
    "strand_bending": "c_b",
    "end_stop": "K eps_s",
    "linear_spring": "K",
    "weight": "m",
    "wall_shielding": "",
    "conical_ends_printed": "k_c",
    "bladder_axial_printed": "G",
    "coulomb_friction": "f_s",
    "textile_friction": "f_s beta",
    "hertz_friction": "f_s",
    "schulte_friction": "f",
    "crossing_friction": "mu_R",
    "constant_friction": "F_c",
    "kinetic_friction": "ratio v_s",
    "bladder_hysteresis": "eta_b",
    "presliding": "x_s",
    "maxwell_slip": "x_s spread",
    "viscous_damping": "B",
    "hill": "a_over_F0 b",
    "creep": "K1 tau",
    "mullins": "m w",
    "slack": "F_s",
    "force_gain": "g",
    "force_offset": "F_off",
    "time_delay": "tau",
    "supply_orifice": "C b n V_d",
    "liquid_line": "R",
    "supply_delay": "tau",
}
OPTIONS = {
    "demo": "--html --json --quiet --reveal --seed",
    "init": "--html --json --quiet --seed",
    "compare": (
        "--alike --baseline --define --effect-file --effects --fix --free --html --json --model --muscle "
        "--own --quiet --seed --set --starts --test"
    ),
    "fit": (
        "--baseline --define --each --effect-file --effects --fix --free --html --json --model --muscle --no-save "
        "--out --own --quiet --save --scheduler --seed --set --starts --test"
    ),
    "diagnose": (
        "--baseline --candidates --define --each --effect-file --effects --fix --free --html --json --model --muscle "
        "--out --own --propose --quiet --rivals --scheduler --seed --set --test"
    ),
    "add": (
        "--baseline --define --effect-file --effects --fix --free --html --json --model --muscle --no-save "
        "--own --quiet --save --seed --set --starts --test"
    ),
    "drop": (
        "--baseline --define --effect-file --effects --fix --free --html --json --model --muscle --no-save "
        "--own --quiet --save --seed --set --starts --test"
    ),
    "discover": (
        "--baseline --candidates --define --effect-file --effects --fix --free --html --json --model --muscle "
        "--no-save --own --quiet --rivals --save --seed --set --starts --test"
    ),
    "plan": (
        "--baseline --candidates --define --effect-file --effects --fix --free --html --json --model --muscle "
        "--own --quiet --rivals --seed --set --test"
    ),
    "posterior": (
        "--again --baseline --chains --define --effect-file --effects --fix --free --html --json --limit "
        "--model --muscle --netcdf --no-chains --own --quick --quiet --sampler --seed --set --starts --steps "
        "--test"
    ),
    "report": (
        "--baseline --candidates --define --effect-file --effects --fix --free --html --json --model --muscle "
        "--no-diagnosis --own --quiet --rivals --seed --set --starts --test"
    ),
    "hill": (
        "--baseline --define --effect-file --effects --fix --free --html --json --model --muscle --no-motion "
        "--own --quiet --seed --set --starts --test"
    ),
    "simulate": (
        "--contraction --duration --effect-file --html --json --load --muscle --noise --out --pressure "
        "--pressures --quiet --rate --seed --speed --test --turns"
    ),
    "export": (
        "--contraction --effect-file --html --json --muscle --out --points --pressure --quiet --seed --to --without"
    ),
    "design": "--also --effect-file --html --json --picture --posterior --quiet --save --seed",
    "sweep": "--effect-file --html --json --out --quiet --scheduler --seed --to",
    "effects": "--effect-file --html --json --quiet --seed",
    "equations": "--html --json --quiet --seed",
    "cite": (
        "--baseline --define --effect-file --effects --fix --free --html --json --model --muscle --own "
        "--quiet --seed --set --test"
    ),
    "evidence": (
        "--baseline --candidates --define --effect-file --effects --fix --free --html --json --model --muscle --own "
        "--quiet --rivals --seed --set --test"
    ),
    "selftest": (
        "--again --baseline --candidates --define --effect-file --effects --fix --free --hide --html --json --log "
        "--model --muscle --own --quiet --rivals --seed --set --test"
    ),
    "library": "--effect-file --html --json --model --name --quiet --seed --to",
    "warm": "--html --json --quiet --seed",
    "workbench": "--candidates --host --no-browser --port --token",
}


def found(name: str) -> Any:
    """What a dotted name stands for: modules as far as they go, then what is in them."""
    parts = name.split(".")
    thing = importlib.import_module(parts[0])
    for count, part in enumerate(parts[1:], 2):
        thing = getattr(thing, part) if hasattr(thing, part) else importlib.import_module(".".join(parts[:count]))
    return thing


def written(thing: Any) -> list[str]:
    """The arguments of a function or class, as they are written in the table."""
    told, starred = [], False
    for p in inspect.signature(thing).parameters.values():
        if p.kind is p.KEYWORD_ONLY and not starred:
            told.append("*")
        starred = starred or p.kind in (p.KEYWORD_ONLY, p.VAR_POSITIONAL)
        told.append(("*" if p.kind is p.VAR_POSITIONAL else "") + p.name + ("" if p.default is p.empty else "="))
    return told


def broken(promised: list[str], now: list[str]) -> list[str]:
    """What a caller who wrote for `promised` would trip over: moved, gone, or newly asked for."""
    in_order = promised[: promised.index("*")] if "*" in promised else promised
    moved = [one for k, one in enumerate(in_order) if now[k : k + 1] not in ([one], [f"{one}="])]
    gone = [one for one in promised if one not in now and f"{one}=" not in now and one != "*"]
    asked = [one for one in now if one not in promised and not one.endswith("=") and one != "*"]
    return sorted({*moved, *gone, *asked})


@pytest.mark.parametrize("name", PYTHON)
def test_a_name_and_its_arguments_are_kept(name):
    promised = [one for one in PYTHON[name].split(", ") if one]
    assert broken(promised, written(found(name))) == []


@pytest.mark.parametrize("kind", [*LIBRARY, *SUPPLIES], ids=name_of)
def test_the_class_of_every_effect_is_at_the_front_door(kind):
    assert getattr(mckibben_jax, kind.__name__) is kind


def test_names_at_the_front_door_do_not_hang_on_the_order_of_imports():
    """`model` and `parameter` are functions, though modules have these names; no other name is that of a module."""
    modules = {path.stem for path in Path(mckibben_jax.__file__).parent.iterdir()}
    promised = {name.split(".")[1] for name in PYTHON if name.startswith("mckibben_jax.")}
    assert promised & modules - {"laws", "design"} == {"model", "parameter"}
    script = "import mckibben_jax.model, mckibben_jax.parameter as p; print(mckibben_jax.model(0).effects, p.__name__)"
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert ran.stdout.split() == ["()", "parameter"]


TYPES = {"Comparison", "Diagnosis", "Experiment", "Fit", "Posterior", "Stage"}  # what functions take and return


def test_the_front_door_is_listed_here():
    promised = {name.split(".")[1] for name in PYTHON if name.startswith("fitting.") and name.count(".") == 1}
    assert set(dir(fitting)) == promised | TYPES


@pytest.mark.parametrize("package", [fitting, fitting.report], ids=["fitting", "report"])
def test_a_front_door_says_the_same_to_people_and_to_type_checkers(package):
    """What `if TYPE_CHECKING` imports is what is loaded when it is asked for."""
    tree = ast.parse(Path(package.__file__).read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    typed = {a.asname: (n.module, a.name) for n in block.body if isinstance(n, ast.ImportFrom) for a in n.names}
    assert set(typed) == set(dir(package))
    for name, (module, original) in typed.items():
        assert getattr(package, name) is getattr(importlib.import_module(str(module)), original), name


def test_the_front_door_opens_at_once():
    script = "import fitting, sys; print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert not set(ran.stdout.split()) & {"jax", "numpy", "pandas", "scipy", "mckibben_jax"}


def test_a_name_that_nobody_promised_is_an_error():
    with pytest.raises(AttributeError, match="'fitting' has no attribute 'diagnoze'"):
        fitting.diagnoze  # noqa: B018


def test_what_a_model_can_do_is_kept():
    assert set(MODEL) <= set(dir(Model))


def test_effects_and_their_parameters_are_kept():
    now = {name_of(kind): {p.name for p in parameters(kind)} for kind in (*LIBRARY, *SUPPLIES)}
    for name, own in EFFECTS.items():
        assert set(own.split()) <= now[name], name


def test_every_effect_is_listed_here():
    assert {name_of(kind) for kind in (*LIBRARY, *SUPPLIES)} == set(EFFECTS)


def numbers() -> dict[str, dict[str, dict]]:
    """Unit, usual value, range and further starting values of every parameter, which fits and designs rest on."""
    return {
        name_of(kind): {
            p.name: {"unit": p.unit, "default": p.default, "range": [p.lower, p.upper], "starts": list(p.starts)}
            for p in parameters(kind)
        }
        for kind in (*LIBRARY, *SUPPLIES)
    }


def test_ranges_and_usual_values_of_parameters_are_those_announced():
    """A range that moves moves posteriors and "at its bound": `python tests/test_public_api.py` writes them anew."""
    assert numbers() == json.loads(NUMBERS.read_text())


def test_every_command_is_listed_here():
    assert set(COMMANDS) == set(OPTIONS)


@pytest.mark.parametrize("name", OPTIONS)
def test_options_are_kept(name):
    command = main.get_command(click.Context(main), name)
    assert command is not None
    now = {option for parameter in command.params for option in parameter.opts}
    assert set(OPTIONS[name].split()) <= now


# ------------------------------------------------------------------------------------------------ the check can tell


@pytest.mark.parametrize(
    ("promised", "now", "trips"),
    [
        (["a", "b="], ["a", "b=", "c="], []),
        (["a", "b"], ["a", "b="], []),
        (["a", "*", "k="], ["a", "*", "j=", "k="], []),
        (["a", "b"], ["b", "a"], ["a", "b"]),
        (["a"], ["a", "b"], ["b"]),
        (["a", "b="], ["a", "b"], ["b", "b="]),
        (["a", "*", "k="], ["a", "*"], ["k="]),
        (["a"], ["x"], ["a", "x"]),
    ],
)
def test_a_broken_promise_is_noticed(promised, now, trips):
    assert broken(promised, now) == trips


if __name__ == "__main__":
    NUMBERS.write_text(json.dumps(numbers(), indent=1) + "\n")
