"""A recording that is proposed, in words: what to record, why, what the rig must be able to do, how to rehearse it."""

from typing import TYPE_CHECKING

from fitting import showing
from fitting.planning.protocols import Demand, Need, Protocol, Specimen
from fitting.planning.settings import GRID
from fitting.report.text.names import mark, marked
from fitting.showing import counted

if TYPE_CHECKING:
    from fitting.planning.candidates import RigAbilities
    from fitting.planning.next_measurement import NextMeasurement

SPECIMENS = {
    Specimen.HALF_AS_LONG: "a muscle half as long",
    Specimen.TWICE_AS_LONG: "a muscle twice as long",
    Specimen.THICK_WALL: "a muscle with a wall twice as thick",
}


def what_text(m: "NextMeasurement") -> str:
    """The recording as one would ask a colleague for it."""
    p = m.protocol
    low, high = (showing.show(value, "Pa", digits=3) for value in p.pressures)
    first, last = (f"{value:.2g}" for value in p.contractions)
    span = f"contraction {first}" if first == last else f"contraction {first} to {last}"
    on = f", on {SPECIMENS[p.specimen]}" if p.specimen else ""
    if p.test == "isometric":
        ramp = showing.show(p.branch_time, "s", digits=2)
        many = counted(m.repeats, "isometric cycle")
        return f"{many} from {low} to {high} and back, each way in {ramp}, held at contraction {first}{on}"
    if p.test == "static":
        return f"{counted(m.repeats, 'static curve')} at {low}, {span}, {GRID.nodes} points each{on}"
    hold = f", {p.hold:g} s of rest at each end" if p.hold else ""
    return f"{counted(m.repeats, 'loop')} at {low}, {span}, {_two(m.speed, 'm/s')}{hold}{on}"


def pull_text(m: "NextMeasurement") -> str:
    """Up to which force, where that is known: whoever hangs weights on needs so many."""
    return f"It pulls up to {showing.show(m.pull, 'N', digits=2)}." if m.pull > 0 else ""


def purpose_text(m: "NextMeasurement") -> str:
    """Why it is proposed: explanations that it separates, or effects that it makes visible."""
    if not m.shows:
        one, other = m.separates
        return f"{marked(one, ' + ')} and {marked(other, ' + ')} predict different forces there"
    seen = (
        f"{mark(v.effect)} ({'not seen by these data' if v.unseen else f'{v.gain:.1f} times smaller than now'})"
        for v in m.shows
    )
    return f"shows {', '.join(seen)}"


def needs_text(p: Protocol) -> str:
    """What the data do not show that the rig can do; empty if nothing."""
    return " and ".join([*([SPECIMENS[p.specimen]] if p.specimen else []), *map(_demand_text, p.unseen)])


def _demand_text(demand: Demand) -> str:
    need, asked, seen = demand
    if need is Need.LENGTH_DRIVE:
        return "a rig that moves the length while the force is read"
    if need is Need.PRESSURE_SWEEP:
        return "a pressure that is swept while the length is held"
    if need is Need.PRESSURE:
        shown = showing.show(seen, "Pa", digits=3)
        return f"more pressure than the {shown} of these data (mind what the muscle bears)"
    if need is Need.SPEED:
        return f"a drive {showing.figures(asked / seen)} times as fast as in these data ({_two(seen, 'm/s')})"
    return (
        f"a pressure that changes {showing.figures(asked / seen)} times as fast as in these data ({_two(seen, 'Pa')}/s)"
    )


def _two(value: float, unit: str) -> str:
    return showing.show(value, unit, digits=2)


def rehearsal_command(p: Protocol, repeats: int, can: "RigAbilities", model: str, folder: str) -> str | None:
    """The command that rehearses the recording on a model; None where `mckibben simulate` cannot do it."""
    if p.hold or p.test == "static" or p.specimen:
        return None
    rate = f'--rate "{1 / can.interval:.4g} Hz" --noise "{showing.show(can.noise, "N", digits=3)}" --out {folder}'
    if p.test == "isometric":
        pressure, size = showing.shown_in("Pa", max(p.pressures))
        low, high = (f"{value / size:.6g}" for value in p.pressures)
        turns = ",".join([low, *[high, low] * repeats])
        order = f'--contraction {p.contractions[0]:.4g} --pressures "{turns} {pressure}"'
        return f'mckibben simulate {model} --test isometric {order} --duration "{p.branch_time:.4g} s" {rate}'
    low, high = (f"{value:.4g}" for value in p.contractions)
    turns = ",".join([low, *[high, low] * repeats])
    speed, pressure = showing.show(p.rate * can.length, "m/s"), showing.show(p.pressures[0], "Pa", digits=6)
    held = f'--pressure "{pressure}" --turns {turns} --speed "{speed}"'
    return f"mckibben simulate {model} --test loop {held} {rate}"
