"""An independent simulator of muscle measurements: the truth behind tests in which an effect is hidden.

    truth = Truth(Muscle(), with_baseline(tip={"k": 1.2}))
    data = rich(truth, noise=COLOURED, seed=3)
    write(data, folder, truth_path)

It imports numpy and scipy only: what it says about physics is a second opinion, not an echo.
"""

from __future__ import annotations

from .felt import elastic, felt, pull
from .instruments import EVERY_KIND, EXACT, LABORATORY, Channel, Instruments
from .lost import lost, size
from .motion import Ride, isotonic, quick_release, step
from .physics import GRAVITY, Muscle, State, Truth
from .rig import EVERY_NOISE, NOISES, UNSTEADY, Dataset, Noise, Recording, force_of, isometric, loops, static
from .strangers import STRANGERS
from .write import seal, stated, truth_record, unseal, write

__all__ = [
    "EVERY_KIND", "EVERY_NOISE", "EXACT", "FRICTIONS", "GRAVITY", "LABORATORY", "NOISES", "STRANGERS", "TYPICAL",
    "TYPICAL_STRANGERS", "UNSTEADY", "Channel", "Dataset", "Instruments", "Muscle", "Noise", "Recording", "Ride",
    "State", "Truth", "dataset", "elastic", "felt", "force_of", "isometric", "isotonic", "loops", "lost", "poor",
    "pull", "quick_release", "rich", "seal", "size", "stated", "static", "step", "truth_record", "unseal",
    "with_baseline", "write",
]  # fmt: skip

COLOURED = Noise(phi=0.7)
FRICTIONS = ("coulomb_friction", "textile_friction", "hertz_friction", "schulte_friction", "crossing_friction")

# A size at which each effect is clearly there in a muscle of 300 mm x 7 mm x 20 deg at 1-5 bar.
TYPICAL = {
    "pressure_offset": {"P_off": 4e3},
    "pressure_gain": {"g": 0.02},
    "contraction_offset": {"eps_off": 0.005},
    "supply_lag": {"tau": 0.02},
    "pressure_drop": {"tau": 0.02},
    "dead_band": {"P_th": 1e4},
    "radial_gap": {"gap": 0.05},
    "series_compliance": {"k_s": 2e5},
    "tip": {"k": 1.15},
    "tip_pressure": {"b_k": 1.15, "a_k": -0.3, "P_k": 1e5},
    "strand_stretch": {"EA": 5e4},
    "conical_ends": {"k_c": 0.2},
    "reduced_length": {"factor": 2.0},
    "bladder_neo_hookean": {"G": 3e5},
    "bladder_mooney_rivlin": {"C10": 1.184e5, "C01": 1.06e4},
    "bladder_ogden": {"G": 3e5, "n": -4.0},
    "bladder_thin_mooney_rivlin": {"C10": 1.184e5, "C01": 1.06e4},
    "bladder_schulte": {"k_e": 3e3},
    "strand_bending": {"c_b": 20.0},
    "end_stop": {"K": 2000.0, "eps_s": 0.21},
    "linear_spring": {"K": 400.0},
    "weight": {"m": 0.8},
    "textile_friction": {"f_s": 0.016, "beta": 0.7},
    "hertz_friction": {"f_s": 0.2},
    "schulte_friction": {"f": 0.006},
    "constant_friction": {"F_c": 12.0},
    "crossing_friction": {"mu_R": 3e-4},
    "kinetic_friction": {"ratio": 2.0, "v_s": 0.05},
    "presliding": {"x_s": 3e-3},
    "maxwell_slip": {"x_s": 3e-3, "spread": 2.5},
    "viscous_damping": {"B": 500.0},
    "hill": {"a_over_F0": 0.12, "b": 0.5},
    "creep": {"K1": 300.0, "tau": 10.0},
    "bladder_hysteresis": {"eta_b": 0.15},
    "mullins": {"m": 0.3, "w": 0.03},
    "force_offset": {"F_off": 5.0},
    "force_gain": {"g": 0.02},
    "time_delay": {"tau": 0.03},
}
TYPICAL_STRANGERS = {
    "strain_bump": {"A": 12.0, "centre": 0.13, "width": 0.02},
    "pressure_stair": {"A": 10.0, "step": 1e5},
    "screw_ripple": {"A": 8.0, "p": 0.012},
    "pressure_squared_spring": {"A": 60.0, "P_ref": 5e5, "eps_ref": 0.2},
    "warming_gain": {"g": 0.04, "tau": 300.0},
    "speed_hump": {"A": 12.0, "v_top": 0.008},
    "striped_friction": {"A": 15.0, "p": 0.02},
    "pressure_speed_spring": {"A": 30.0, "P_ref": 3e5, "v_ref": 0.02, "eps_ref": 0.2},
}


def with_baseline(f_s: float | None = 0.012, **hidden: dict[str, float]) -> dict[str, dict[str, float]]:
    """Ideal cylinder and Coulomb friction, and what is hidden; a hidden friction takes Coulomb's place."""
    effects = {"ideal_cylinder": {}}
    if f_s is not None and not set(FRICTIONS) & set(hidden):
        effects["coulomb_friction"] = {"f_s": f_s}
    return {**effects, **hidden}


def dataset(truth: Truth, recordings, name="Muscle", noise=COLOURED, seed=0, **errors: float) -> Dataset:
    """Recordings with the muscle as its owner states it (`errors`: standard uncertainties, SI)."""
    return Dataset(name, stated(truth.muscle, seed, **errors), truth, tuple(recordings), noise, seed)


def rich(truth: Truth, noise=COLOURED, seed=0, errors=None, **protocol) -> Dataset:
    """1 to 5 bar, two speeds, a major and a minor loop each: 20 loops, 10,000 samples."""
    return dataset(truth, [loops(truth, noise=noise, seed=seed, **protocol)], "Rich", noise, seed, **(errors or {}))


def poor(truth: Truth, noise=COLOURED, seed=0, errors=None, **protocol) -> Dataset:
    """Two pressures, one speed, two major loops each, no minor ones: four loops."""
    given = {"pressures": (2e5, 4e5), "speeds": (0.01,), "turns": (0.0, 0.25, 0.0, 0.25, 0.0), "samples": 800}
    recording = loops(truth, noise=noise, seed=seed, **{**given, **protocol})
    return dataset(truth, [recording], "Poor", noise, seed, **(errors or {}))
