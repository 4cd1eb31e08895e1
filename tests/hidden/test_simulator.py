"""The simulator against published values, closed forms and its own energies: right before it judges."""

import json

import numpy as np
import pytest
from scipy.integrate import quad

from . import felt as felt_laws
from . import lost as lost_laws
from . import make_shipped, physics
from .simulator import (
    EVERY_NOISE,
    GRAVITY,
    STRANGERS,
    TYPICAL,
    TYPICAL_STRANGERS,
    Muscle,
    Noise,
    Ride,
    State,
    Truth,
    elastic,
    force_of,
    isometric,
    isotonic,
    loops,
    poor,
    pull,
    quick_release,
    rich,
    seal,
    static,
    step,
    unseal,
    with_baseline,
    write,
)

GOLDEN = Muscle(length=0.2, radius=0.010, braid_angle=np.radians(25.0), wall_thickness=0.003)
WHOLE = Muscle(shear_modulus=5.4e5, strand_width=3e-4, strand_modulus=2e9, strand_poisson=0.4)
QUIET = Noise(sd=0.0)


@pytest.mark.parametrize(
    ("law", "given", "contraction", "pressure", "value"),
    [
        (physics.ideal_cylinder, {}, 0.0, 4e5, 1030.1684264362932),
        (physics.ideal_cylinder, {}, 0.05, 5e5, 1076.4099713081064),
        (physics.ideal_cylinder, {}, 0.15, 1e5, 137.26332531247903),
        (physics.bladder_mooney_rivlin, {"C10": 118400.0, "C01": 10600.0}, 0.15, 0.0, -158.8668838675154),
        (physics.bladder_thin_mooney_rivlin, {"C10": 118400.0, "C01": 10600.0}, 0.05, 0.0, -78.3255808236467),
        (physics.bladder_schulte, {"k_e": 1e4}, 0.35, 0.0, -120.68511262010115),
    ],
)
def test_forces_agree_with_reference_values(law, given, contraction, pressure, value):
    assert law(GOLDEN, State(contraction, pressure), **given) == pytest.approx(value, rel=1e-8)


def test_total_of_ideal_law_and_thick_wall():
    truth = Truth(GOLDEN, {"ideal_cylinder": {}, "bladder_mooney_rivlin": {"C10": 118400.0, "C01": 10600.0}})
    assert float(pull(truth, State(0.05, 5e5))) == pytest.approx(947.0383622444149, rel=1e-8)


def test_friction_laws_agree_with_reference_values():
    strands = Muscle(0.2, 0.010, float(np.radians(25.0)), 0.003, strand_modulus=2e9, strand_poisson=0.4)
    there = State(0.05, 5e5)
    assert lost_laws.hertz_friction(strands, there, 0.2) == pytest.approx(94.22289827361489, rel=1e-9)
    assert lost_laws.schulte_friction(GOLDEN, State(0.0, 4e5), 0.07) == pytest.approx(351.85837720205683, rel=1e-9)
    assert physics.contact_surface(GOLDEN, State(0.0, 0.0)) == pytest.approx(0.012566370614359173, rel=1e-12)


def test_tip_scales_the_argument():
    truth = Truth(GOLDEN, {"ideal_cylinder": {}, "tip": {"k": 1.25}})
    state = felt_laws.felt(truth, State(0.05, 5e5))
    assert float(pull(truth, state)) == pytest.approx(1025.27794434925, rel=1e-9)


def test_cones_agree_with_reference_value():
    muscle = Muscle(0.264, 0.0087, float(np.radians(17.254233807405)), 0.0024)
    truth = Truth(muscle, {"ideal_cylinder": {}, "conical_ends": {"k_c": 0.5}})
    assert float(pull(truth, State(0.38, 3e5))) == pytest.approx(-431.6345233664665, rel=1e-9)


@pytest.mark.parametrize("stretch", [0.0, 0.01])
@pytest.mark.parametrize(("name", "given"), [("conical_ends", {"k_c": 0.3}), ("reduced_length", {"factor": 1.7})])
def test_pressure_work_is_pressure_times_volume(name, given, stretch):
    muscle, pressure = Muscle(), 3e5

    def volume(contraction):
        state = State(contraction, pressure, stretch=stretch)
        radius, length = physics.outer_radius(muscle, state), muscle.length * (1 - contraction)
        if name == "reduced_length":
            return np.pi * radius**2 * (length - 1.7 * (radius - muscle.radius))
        cone = 0.3 * muscle.length * contraction
        ends = 2 * np.pi / 3 * cone * (radius**2 + radius * muscle.radius + muscle.radius**2)
        return np.pi * radius**2 * (length - 2 * cone) + ends

    truth = Truth(muscle, {"ideal_cylinder": {}, name: given})
    work = quad(lambda e: float(pull(truth, State(e, pressure, stretch=stretch))) * muscle.length, 0.02, 0.2)[0]
    assert work == pytest.approx(pressure * (volume(0.2) - volume(0.02)), rel=1e-9)


@pytest.mark.parametrize("outside", [0.0, 0.9e-3])
def test_rubber_gives_back_its_energy(outside):
    muscle, C10, C01 = Muscle(wall_thickness=1.8e-3, wall_outside=outside), 1.2e5, 2e4

    def energy(contraction):
        axial = 1 - contraction
        radius = physics.outer_radius(muscle, State(contraction, 0.0))

        def density(ring):
            hoop = np.sqrt(radius**2 + (ring**2 - muscle.radius**2) / axial) / ring
            first = hoop**2 + axial**2 + 1 / (hoop * axial) ** 2 - 3
            second = 1 / hoop**2 + 1 / axial**2 + (hoop * axial) ** 2 - 3
            return (C10 * first + C01 * second) * 2 * np.pi * ring * muscle.length

        return quad(density, muscle.radius + outside - 1.8e-3, muscle.radius + outside, epsabs=1e-13)[0]

    truth = Truth(muscle, {"bladder_mooney_rivlin": {"C10": C10, "C01": C01}})
    work = quad(lambda e: float(elastic(truth, State(e, 0.0))) * muscle.length, 0.0, 0.2)[0]
    assert work == pytest.approx(-(energy(0.2) - energy(0.0)), rel=1e-8)


def test_series_spring_and_muscle_pull_alike():
    truth = Truth(Muscle(), {"ideal_cylinder": {}, "series_compliance": {"k_s": 1e5}, "tip": {"k": 1.2}})
    state = felt_laws.felt(truth, State(np.array([0.0, 0.1, 0.2]), 4e5))
    own = np.asarray(state.contraction) / 1.2
    yielding = (own - np.array([0.0, 0.1, 0.2])) * truth.muscle.length
    np.testing.assert_allclose(yielding * 1e5, pull(truth, state), rtol=1e-9)


def test_stretched_cord_carries_its_own_force():
    muscle, pressure = Muscle(), 5e5
    truth = Truth(muscle, {"ideal_cylinder": {}, "strand_stretch": {"EA": 5e4}})
    state = felt_laws.felt(truth, State(0.1, pressure))
    cord = muscle.length / np.cos(muscle.braid_angle) * (1 + state.stretch)
    turns = muscle.length * np.tan(muscle.braid_angle) / (2 * np.pi * muscle.radius)
    gaylord = pressure * (3 * (0.9 * muscle.length) ** 2 - cord**2) / (4 * np.pi * turns**2)
    assert float(pull(truth, state)) == pytest.approx(gaylord, rel=1e-10)


def test_dahl_and_maxwell_slip_against_closed_forms():
    path = np.concatenate([np.linspace(0, 0.02, 400), np.linspace(0.02, 0.015, 100)[1:]])
    z = lost_laws.dahl(path, 3e-3)
    turn = 1 - np.exp(-0.02 / 3e-3)
    assert z[399] == pytest.approx(turn, rel=1e-9)
    assert z[-1] == pytest.approx(-1 + (turn + 1) * np.exp(-0.005 / 3e-3), rel=1e-9)
    slipped = lost_laws.maxwell_slip(path, 3e-3, 2.0)
    reaches = 3e-3 * 2.0 ** (np.array([-3, -1, 1, 3]) / 3)
    assert slipped[399] == 1.0
    assert slipped[-1] == pytest.approx(np.mean(np.maximum(1 - 0.005 / reaches, -1)), rel=1e-9)


def test_maxwell_slip_forgets_an_inner_loop_once_it_is_closed():
    outer = lost_laws.maxwell_slip(np.array([0.0, 0.02, 0.017]), 3e-3, 2.0)
    inner = lost_laws.maxwell_slip(np.array([0.0, 0.02, 0.018, 0.0195, 0.018, 0.017]), 3e-3, 2.0)
    assert inner[-1] == pytest.approx(outer[-1], abs=1e-12)


def test_creep_and_lag_on_a_ramp():
    time = np.linspace(0, 20, 401)
    settled = 0.01 * time - lost_laws.relaxed(time, 0.01 * time, 2.0)
    np.testing.assert_allclose(settled, 0.02 * (1 - np.exp(-time / 2.0)), atol=1e-12)
    np.testing.assert_allclose(felt_laws.lagged(time, time, 0.5), time - 0.5 * (1 - np.exp(-time / 0.5)), atol=1e-12)


def test_free_tube_gap_pressure():
    muscle = Muscle(wall_thickness=5e-4, shear_modulus=5.4e5)
    gap = 1 - 1 / 3.0
    share = 5e-4 / (muscle.radius * (1 - gap))
    at_three = felt_laws.gap_pressure(muscle, gap) * (1 - share) / (5.4e5 * share)
    assert at_three == pytest.approx(0.4694729587387845, rel=1e-8)


def test_fine_grid_is_fine_enough():
    """Twice the samples, same forces: memory and rates have converged."""
    effects = with_baseline(presliding={"x_s": 2e-3}, viscous_damping={"B": 500.0}, creep={"K1": 300.0, "tau": 5.0})
    coarse = loops(Truth(WHOLE, effects), pressures=(3e5,), speeds=(0.01,), samples=401, rounding=0, noise=QUIET)
    fine = loops(Truth(WHOLE, effects), pressures=(3e5,), speeds=(0.01,), samples=801, rounding=0, noise=QUIET)
    turning = np.abs(np.gradient(coarse.columns["displacement"], coarse.columns["time"])) < 0.0099
    np.testing.assert_allclose(coarse.clean[~turning], fine.clean[::2][~turning], atol=2e-3)


def test_quick_release_of_a_spring_against_its_closed_form():
    """Spring + constant friction + load: half cosines that lose 2 F_c each, then rest (eq 47)."""
    muscle, stiffness, friction, mass = Muscle(), 4000.0, 20.0, 8.0
    effects = {
        "force_offset": {"F_off": 0.0},
        "linear_spring": {"K": stiffness},
        "constant_friction": {"F_c": friction},
    }
    truth = Truth(muscle, {**effects, "weight": {"m": -40.0}})
    times = np.linspace(0, 2.0, 801)
    place = Ride(truth, mass * GRAVITY, lambda _t: 0.0).run(times)
    drive, omega = 32.0 * GRAVITY, np.sqrt(stiffness / mass)
    centre, dead, expected = drive / stiffness, friction / stiffness, np.empty_like(times)
    x, sign, start = 0.0, 1.0, 0.0
    while True:
        end = start + np.pi / omega
        middle = centre - sign * dead
        inside = (times >= start) & (times <= end)
        expected[inside] = middle + (x - middle) * np.cos(omega * (times[inside] - start))
        x, start, sign = 2 * middle - x, end, -sign
        if abs(x - centre) <= dead or start > times[-1]:
            break
    expected[times > start] = x
    np.testing.assert_allclose(place, expected, atol=2e-6)


def test_isotonic_balance_is_kept():
    truth = Truth(WHOLE, with_baseline())
    recording = isotonic(truth, masses=(15.0,), noise=QUIET, samples=200)
    state = State(recording.clean / WHOLE.length, recording.columns["pressure"])
    missing = np.abs(pull(truth, state) - 15.0 * GRAVITY)
    assert np.all(missing <= lost_laws.size(truth, state) * (1 + 1e-6) + 1e-6)


def hidden_alone(name):
    """A truth in which one effect is hidden, with rubber where it needs some."""
    extra = {"bladder_neo_hookean": {"G": 3e5}} if name in ("bladder_hysteresis", "mullins") else {}
    given = {**TYPICAL, **TYPICAL_STRANGERS}[name]
    return Truth(WHOLE, with_baseline(**extra, **{name: given})), Truth(WHOLE, with_baseline(**extra))


@pytest.mark.parametrize("name", [*TYPICAL, *STRANGERS])
def test_every_effect_shows_in_loops_unless_nothing_moves_it(name):
    there, absent = (loops(truth, pressures=(1e5, 4e5), samples=200, noise=QUIET).clean for truth in hidden_alone(name))
    misfit = np.sqrt(np.mean((there - absent) ** 2))
    assert np.all(np.isfinite(there))
    assert misfit < 1e-9 if name == "supply_lag" else 1.0 < misfit < 120.0


@pytest.mark.parametrize("protocol", [isometric, static, quick_release, step])
@pytest.mark.parametrize("name", list(TYPICAL))
def test_every_effect_runs_in_every_protocol(name, protocol):
    small = {
        isometric: {"contractions": (0.0, 0.1), "samples": 60},
        static: {},
        quick_release: {"masses": (40.0,), "duration": 0.1},
        step: {"masses": (10.0,), "levels": ((1.5e5, 3e5),), "duration": 0.2},
    }
    truth = hidden_alone(name)[0]
    assert np.all(np.isfinite(protocol(truth, noise=QUIET, **small[protocol]).clean))


def test_isometric_friction_rests_with_the_braid():
    truth = Truth(WHOLE, with_baseline())
    recording = isometric(truth, noise=QUIET, samples=100)
    state = State(recording.columns["displacement"] / WHOLE.length, recording.columns["pressure"])
    np.testing.assert_allclose(recording.clean, pull(truth, state), rtol=1e-12)


def test_order_of_effects_does_not_matter():
    effects = with_baseline(tip={"k": 1.1}, dead_band={"P_th": 1e4}, bladder_neo_hookean={"G": 3e5})
    time = np.linspace(0, 10, 400)
    swings = 0.1 + 0.05 * np.sin(time)
    one, other = (
        force_of(Truth(WHOLE, dict(order)), time, swings, np.full(400, 3e5))
        for order in (list(effects.items()), list(effects.items())[::-1])
    )
    np.testing.assert_allclose(one, other, rtol=1e-12)


@pytest.mark.parametrize("kind", list(EVERY_NOISE))
def test_noise_has_the_stated_size(kind):
    noise = EVERY_NOISE[kind]
    recording = rich(Truth(WHOLE, with_baseline()), noise=noise, seed=4).recordings[0]
    error = recording.columns["force"] - recording.clean
    rounding = noise.step / np.sqrt(12)
    expected = np.sqrt(noise.sd**2 * (1 + noise.drift**2 + noise.zero**2) + rounding**2)
    assert np.std(error) == pytest.approx(expected, rel=0.35)
    again = rich(Truth(WHOLE, with_baseline()), noise=noise, seed=4).recordings[0]
    np.testing.assert_array_equal(recording.columns["force"], again.columns["force"])


def test_written_folder(tmp_path):
    data = poor(Truth(WHOLE, with_baseline(tip={"k": 1.2})), seed=2, errors={"radius": 1e-4})
    folder = write(data, tmp_path / "poor", tmp_path / "truth.json")
    text = (folder / "loops.csv").read_text().splitlines()
    assert text[0] == "run,time [s],pressure [kPa],displacement [mm],force [N]"
    assert len(text) == 1601
    assert "+/- 0.1 mm" in (folder / "muscle.toml").read_text()
    assert "tip" not in (folder / "muscle.toml").read_text()
    assert json.loads((tmp_path / "truth.json").read_text())["parameters"]["tip.k"] == 1.2


def test_sealed_records_open_again():
    record = {"effects": ["tip"], "seed": 1}
    assert "tip" not in json.dumps(seal(record))
    assert unseal(seal(record)) == record


@pytest.mark.parametrize("name", [path.stem for path in sorted((make_shipped.DATA / "sealed").glob("*.json"))])
def test_shipped_data_are_what_their_records_say(name, tmp_path):
    for path in sorted(make_shipped.make(name, tmp_path).iterdir()):
        assert path.read_text() == (make_shipped.DATA / name / path.name).read_text()
