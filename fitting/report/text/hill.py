"""What quick releases say of Hill's law, in words, in a table, and for machines."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from rich.console import RenderableType

from fitting import showing
from fitting.hill.hill import Curves, HillCurve, Reading, loads_of
from fitting.hill.motion import Motions
from fitting.hill.settings import RELEASES
from fitting.report.text.amounts import amount, places
from fitting.report.text.layout import columns, line, lines
from fitting.report.text.names import mark, marked

STRAIGHT = (
    "The b of that fit is far above every speed here, where Hill's force is straight in speed: of a and b only "
    "(F0 + a)/b is found. Try ⟦viscous_damping⟧, which says that with one number and acts both ways."
)
ALIKE = (
    "These speeds cannot tell Hill's law from a load's inertia with dry friction, which has no viscosity at all. "
    "Ramps at constant speed would tell: inertia has no part in them."
)
ANIMALS = "0.12 to 0.4 in animals"  # Klute et al. 2002, by Tondu 2012 beside eq 46


def hill_report(
    curves: Sequence[Curves], motions: Motions | None, groups: Sequence[Sequence[Reading]] = ()
) -> list[RenderableType]:
    """Hill's numbers, what else gives them, and the readings they rest on; of `groups` of readings those too small."""
    shown: list[RenderableType] = []
    for one in curves:
        shown.append(line("HILL", _numbers(one.hill), "bold"))
        shown.append(line("DRY", _dry(one)))
        shown += lines("WARNING", [ALIKE], "yellow") if one.alike else []
    shown += lines("LEFT OUT", [_few(read) for read in groups if loads_of(read) < RELEASES.fewest_loads], "yellow")
    shown += [] if motions is None else _motion(motions, max(r.speed for one in curves for r in one.hill.readings))
    return [*shown, line("", ""), _table(curves)]


def _few(read: Sequence[Reading]) -> str:
    pressure = showing.show(float(np.mean([reading.pressure for reading in read])), "Pa")
    here = f"{len(read)} releases at {pressure}: {loads_of(read)} loads there"
    return f"{here}, and a curve needs {RELEASES.fewest_loads}."


def _numbers(c: HillCurve) -> str:
    b, force = showing.show(c.b, "m/s", c.b_error), showing.show(c.isometric, "N", c.isometric_error)
    return (
        f"a/F0 = {c.curvature:.3f} +/- {c.curvature_error:.3f} ({ANIMALS}), b = {b}, "
        f"F0 = {force} at {showing.show(c.pressure, 'Pa')}; "
        f"{len(c.readings)} loads, {100 * c.misfit:.1f} % rms off the curve. Its errors are those of this scatter."
    )


def _dry(one: Curves) -> str:
    read = one.dry.read_as_hill
    return (
        f"Inertia and constant friction alone (eq 47), fitted to the same speeds, are {100 * one.dry.misfit:.1f} % "
        f"off; read as Hill's they would give a/F0 = {read.curvature:.2f} +/- {read.curvature_error:.2f}."
    )


def _motion(motions: Motions, fastest: float) -> list[RenderableType]:
    """The models fitted to the positions themselves."""
    dry, viscous = (showing.show(error, "m") for error in motions.errors)
    units = {name: motions.viscous.layout.entry(name).unit for name in motions.direct}
    values = (
        f"{mark(name)} = {showing.show(value, units[name], error)}" for name, (value, error) in motions.direct.items()
    )
    told = f"Fitted to the positions, a model without viscosity misses them by {dry} rms, one with it by {viscous}: "
    return [line("MOTION", told + said_of_viscosity(motions, ", ".join(values), fastest))]


def said_of_viscosity(motions: Motions, values: str, fastest: float) -> str:
    """What the two errors say of viscosity."""
    dry, viscous = motions.errors
    if viscous > dry and motions.explained:
        return "Hill's force, even at its faintest, is more than this motion bears."
    plain = " " + STRAIGHT if motions.straight(fastest) else ""
    if viscous > dry / 2 and not motions.explained:
        return (
            "far more than their noise, with it or without. What moves so is something else, and a/F0 and b of that "
            "fit mean nothing: `mckibben diagnose` looks for it. Or both fits ended in a wrong place: --shooting 8 "
            f"cuts each release into eight pieces, which are easier to fit.{plain}"
        )
    if viscous > dry / 2:
        return "no need of viscosity, and a/F0 and b of that fit mean nothing."
    told = f"it asks for drag that grows with speed. {values}."
    if motions.at_ends and not plain:
        told += f" {marked(motions.at_ends, ' and ')} at an end of the range: the error means nothing."
    if not motions.explained:
        told += (
            " It still misses by far more than noise: the drag is not Hill's, or another part of the model is wrong, "
            "such as its friction. `mckibben diagnose` looks for it."
        )
    elif not plain and not motions.at_ends:
        told += f" Trust these before the numbers after HILL: {_read_again(motions)}"
    return told + plain


def _read_again(motions: Motions) -> str:
    """Why the numbers read off the speeds differ from those of the model, with what the model itself would read as."""
    read = ", ".join(f"{one.curvature:.3f} at {showing.show(one.pressure, 'Pa')}" for one in motions.read_again)
    why = "the speeds are reached only when the muscle is shorter by some millimetres already and pulls less."
    return f"read so, the motion of this model gives a/F0 = {read}, for {why}" if read else why


def _table(curves: Sequence[Curves]) -> RenderableType:
    fastest = max(r.speed for one in curves for r in one.hill.readings)
    name, size = showing.shown_in("m/s", fastest)
    after = places((fastest / size,), 4)
    speeds = (f"{head} [{name}]" for head in ("steady speed", "+/-", "Hill", "dry friction"))
    table = columns("run", "load", "from", "to", *speeds, words=())
    for one in curves:
        for r in one.hill.readings:
            shown = (r.speed, r.error, float(one.hill.speed(r.load)), float(one.dry.speed(r.load)))
            table.add_row(r.run, amount(r.load, "N"), f"{r.begin:.3f} s", f"{r.end:.3f} s",
                          *(f"{value / size:.{after}f}" for value in shown))  # fmt: skip
    return table


def hill_result(curves: Sequence[Curves], motions: Motions | None) -> dict[str, Any]:
    """The same for machines, SI."""
    result: dict[str, Any] = {"curves": [_curve(one) for one in curves], "motion": None}
    if motions is not None:
        dry, viscous = motions.errors
        direct = {name: {"value": value, "robust_error": error} for name, (value, error) in motions.direct.items()}
        result["motion"] = {"parameters": direct, "rmse_without_viscosity_m": dry, "rmse_with_hill_m": viscous}
    return result


def _curve(one: Curves) -> dict[str, Any]:
    c = one.hill
    keys = {"run": "run", "load": "load_N", "pressure": "pressure_Pa", "speed": "speed_m_per_s",
            "error": "speed_error_m_per_s", "begin": "begin_s", "end": "end_s"}  # fmt: skip
    return {
        "pressure_Pa": c.pressure,
        "a_over_F0": c.curvature,
        "a_over_F0_error": c.curvature_error,
        "a_N": c.a,
        "b_m_per_s": c.b,
        "b_error_m_per_s": c.b_error,
        "F0_N": c.isometric,
        "F0_error_N": c.isometric_error,
        "V_max_m_per_s": c.largest,
        "misfit": c.misfit,
        "dry_friction": {"misfit": one.dry.misfit, "heaviest_N": one.dry.heaviest,
                         "a_over_F0": one.dry.read_as_hill.curvature},
        "alike": one.alike,
        "readings": [{key: getattr(reading, name) for name, key in keys.items()} for reading in c.readings],
    }  # fmt: skip
