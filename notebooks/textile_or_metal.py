import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium")

with app.setup(hide_code=True):
    from typing import NamedTuple

    import jax
    import jax.numpy as jnp
    import marimo as mo
    import matplotlib.pyplot as plt
    import numpy as np
    from scipy.constants import g
    from scipy.optimize import least_squares
    from scipy.stats import qmc

    from fitting import use_64_bit
    from fitting.hill.hill import Reading, hill_curve
    from fitting.report import BLUE, GREEN, GREY, ORANGE, SKY, VERMILION
    from mckibben_jax import (
        CoulombFriction,
        IdealCylinder,
        KineticFriction,
        Muscle,
        State,
        SupplyLag,
        ViscousDamping,
        model,
        parameters,
    )
    from mckibben_jax.laws import biology, braid, reynolds, textile
    from mckibben_jax.motion.motion import moved

    use_64_bit()

    LENGTH, RADIUS, ANGLE, PRESSURE = 0.3, 0.007, np.radians(20), 5e5
    STRONGEST = float(braid.ideal_force(0.0, PRESSURE, RADIUS, ANGLE))
    MASSES = np.array([0.1, 5.0, 15.0, 25.0, 35.0])  # kg; the review quotes the first and the last
    STEP_TIME, RELEASE_TIME = np.linspace(0, 2, 401), np.linspace(0, 0.6, 241)  # s
    HEAVIEST, RELEASES = 0.9, 6  # of the quick releases; load over the strongest pull: not quoted

    # What is quoted, and how sharply it is taken
    QUICKEST, SLOWEST, TIME_ERROR = 0.5, 0.7, 0.03  # s, rayon
    OVERSHOOT_ERROR, SEEN = 0.01, 0.05  # of the way; an overshoot below SEEN would not be called one
    CURVATURE_ERROR = 0.1  # of a/F0
    RATIO = 7  # of friction, to which the review was led for rayon (beside eq 48)
    QUOTED = {"rayon": biology.CURVATURE_RAYON, "iron": biology.CURVATURE_IRON}
    UNREAD, LEAST_WAY = 100.0, 1e-4  # errors of a fact that cannot be read; m, m/s: what moves less stands

    # Where the answers are looked for, evenly over the logarithm: the ranges that the library declares
    _EFFECTS = (CoulombFriction, KineticFriction, SupplyLag, ViscousDamping)
    _RANGES = {d.name: (d.lower, d.upper) for effect in _EFFECTS for d in parameters(effect)}
    RIG = {"valve": _RANGES["tau"], "lightest": (0.02, 0.5)}  # s; lightest load of the releases over the strongest pull
    BRAID = {"f_s": (1e-3, _RANGES["f_s"][1]), "ratio": _RANGES["ratio"], "v_s": _RANGES["v_s"], **RIG}
    RIVAL = {
        "B": (1.0, _RANGES["B"][1]),
        "K": (STRONGEST / (0.5 * LENGTH), STRONGEST / (0.05 * LENGTH)),  # strokes of a half to a twentieth
        **RIG,
    }
    LOOKS, STARTS, FEW, SEED = 1024, 16, 8, 0  # points of a Sobol sequence; the best of them, searched from
    NEAR, TURNS = 0.1, 20  # of each range, to either side of the best: more starts, to see how much room is left
    BLOCK = 6  # muscles in one compiled call: a place and its neighbours


@app.cell(hide_code=True)
def _(answer):
    if not mo.running_in_notebook():
        print(answer)
    mo.md(f"# Textile or metal braid: why does one muscle overshoot and the other not?\n\n{answer}")
    return


@app.cell(hide_code=True)
def _():
    mo.md(f"""
    ## What is quoted

    Tondu 2012 describes two muscles, one braided with rayon, one with iron (figures 15 and 18). Its numbers are few:

    | | rayon | iron |
    |---|---|---|
    | step of pressure, 0.1 to 35 kg | never overshoots | overshoots with every load |
    | response time | {QUICKEST} to {SLOWEST} s | - |
    | a/F0 from quick releases | {QUOTED["rayon"]} | {QUOTED["iron"]} |

    Both stand behind the same valve. Not quoted, and chosen here: a braid of 30 cm, 7 mm and 20 deg, 5 bar, a valve of
    first order, a load on a support until the muscle can lift it, response time as the time to 95 % of the way. Whatever
    hangs on these is no result. Iron's overshoots come out larger than any muscle with a mass of its own would show.

    ## The model

    The ideal law, Coulomb friction, and a friction that changes with speed (48), from f_s at rest to ratio f_s when fast.
    Nothing else. These three numbers, the valve's time constant and the lightest load of the quick releases (a/F0 depends
    on it where there is no viscosity, `hill_or_not.py`) are *found*: {LOOKS} points of a Sobol sequence over the ranges
    that the library declares (f_s from {BRAID["f_s"][0]:g} on), least squares of the quoted facts from the best {STARTS},
    and from {STARTS} more that lie up to a tenth of each range from where the best search ended. No start is chosen by
    hand. Iron's valve is held to what rayon's facts leave of it, and iron is looked for a second time with the loads of
    rayon too, for the review calls the conditions of its releases the same.
    """)
    return


@app.cell
def _():
    found = {"rayon": searched("rayon", simulated, BRAID)}
    found["iron"] = searched("iron", simulated, {**BRAID, "valve": left(found["rayon"], 3)})
    _same = {name: left(found["rayon"], list(BRAID).index(name)) for name in RIG}
    same_loads = best(searched("iron", simulated, BRAID | _same, FEW, room=False))
    return found, same_loads


@app.cell
def _(found):
    told = {name: facts(best(found[name]).x[None], simulated)[0] for name in found}
    responses(told)
    return (told,)


@app.cell(hide_code=True)
def _(found):
    mo.md(f"""
    ## What the facts leave undetermined

    Of {2 * STARTS} searches {len(good(found["rayon"]))} end where every fact of rayon is met within its error, and
    {len(good(found["iron"]))} where every fact of iron is. All of these are equally good; the facts leave at least this
    much room:

    | | looked for in | rayon | iron |
    |---|---|---|---|
    {room_rows(found)}
    """)
    return


@app.cell
def _(found):
    friction_over_speed(found)
    return


@app.cell(hide_code=True)
def _():
    mo.md("""
    The mechanism is in this picture: rayon's friction grows many times over within the speeds of the motion and takes
    the energy out of it; iron's may rise or fall with speed, as long as little of it is left when fast. (The review:
    lubricants on finished yarn.)

    ## The rival: Reynolds' three elements (41)

    Spring, damper and contractile element in parallel, at constant pressure linear: M x'' + B x' + K x = F_ce - M g. F_ce is
    the pull at rest; B, K, the valve and the lightest load are looked for in the same way, iron's behind rayon's valve.
    """)
    return


@app.cell
def _():
    rival = {"rayon": searched("rayon", rival_simulated, RIVAL, FEW, room=False)}
    rival["iron"] = searched("iron", rival_simulated, RIVAL | {"valve": left(rival["rayon"], 2)}, FEW, room=False)
    return (rival,)


@app.cell
def _(found, rival, same_loads, told):
    answer = sentence(found, same_loads, told, rival)
    return (answer,)


@app.class_definition(hide_code=True)
class Facts(NamedTuple):
    """What the review would quote of a muscle; nan where it cannot be read."""

    overshoot: np.ndarray  # (masses,), share of the way
    times: np.ndarray  # (masses,), s to 95 % of the way
    curvature: float  # a/F0
    steps: np.ndarray  # (masses, times), m


@app.function(hide_code=True)
def one_step(muscle, load, tau):
    """Shortening (m) after a pressure step through a first-order valve; the load (N) stands until it can be lifted."""
    pressure = PRESSURE * (1 - jnp.exp(-STEP_TIME / tau))
    states = State(jnp.zeros(len(STEP_TIME)), pressure, time=jnp.asarray(STEP_TIME))
    return LENGTH * moved(muscle, states, load, 0.0, steps=500, since=lifts(load, tau)).contraction


@app.function(hide_code=True)
def lifts(load, tau):
    """When the pressure is high enough for a load (N), s; at the end of the recording if it never is."""
    return jnp.minimum(-tau * jnp.log(1 - load / STRONGEST), STEP_TIME[-1])


@app.function(hide_code=True)
def one_release(muscle, load):
    """Highest speed (m/s) after a quick release under a load (N)."""
    time = jnp.asarray(RELEASE_TIME)
    states = State(jnp.zeros(len(time)), jnp.full(len(time), PRESSURE), time=time)
    return LENGTH * jnp.max(moved(muscle, states, load, 0.0, steps=400, since=0.0).rate)


@app.function(hide_code=True)
def release_loads(lightest):
    """Loads of the quick releases, N."""
    return jnp.linspace(lightest, HEAVIEST, RELEASES) * STRONGEST


@app.function(hide_code=True)
@jax.jit
def simulated(many):
    """Step responses of all masses, loads of the releases, and the highest speed of each; a row of `many` a muscle."""

    def one(values):
        size, ratio, scale, tau, lightest = values
        friction = CoulombFriction(f_s=size), KineticFriction(ratio=ratio, v_s=scale)
        muscle = model(Muscle(LENGTH, RADIUS, ANGLE), IdealCylinder(), *friction)
        steps = jax.vmap(lambda load: one_step(muscle, load, tau))(jnp.asarray(MASSES * g))
        loads = release_loads(lightest)
        return steps, loads, jax.vmap(lambda load: one_release(muscle, load))(loads)

    return jax.vmap(one)(many)


@app.function(hide_code=True)
def facts(many, simulate):
    """The facts of each muscle: rows of f_s, ratio, v_s (m/s), valve (s), lightest load; in blocks of one size."""
    filled = np.resize(many, (-(-len(many) // BLOCK) * BLOCK, many.shape[1]))
    blocks = [simulate(block) for block in filled.reshape(-1, BLOCK, many.shape[1])]
    steps, loads, speeds = (np.concatenate(part)[: len(many)] for part in zip(*blocks, strict=True))
    return [Facts(*of_steps(x), read_curvature(w, v), x) for x, w, v in zip(steps, loads, speeds, strict=True)]


@app.function(hide_code=True)
def of_steps(steps):
    """Overshoot as a share of the way, and time (s) to 95 % of it; nan where a load is not moved."""
    ends = np.where(steps[:, -1] > LEAST_WAY, steps[:, -1], np.nan)
    times = [
        float(np.interp(0.95, np.maximum.accumulate(x / end), STEP_TIME)) for x, end in zip(steps, ends, strict=True)
    ]
    return steps.max(1) / ends - 1, np.where(np.isnan(ends), np.nan, times)


@app.function(hide_code=True)
def read_curvature(loads, speeds):
    """a/F0 as the program reads it from speeds over loads; nan where a load stands."""
    if not np.min(speeds) > LEAST_WAY:
        return np.nan
    read = [Reading("", float(load), PRESSURE, float(v), 0.0, 0.0, 0.0) for load, v in zip(loads, speeds, strict=True)]
    return hill_curve(read).curvature


@app.function(hide_code=True)
def misfit(name, told):
    """By how many errors each quoted fact is missed."""
    bent = np.log(told.curvature / QUOTED[name]) / CURVATURE_ERROR
    if name == "iron":
        rows = np.array([*np.maximum(0, SEEN - told.overshoot) / OVERSHOOT_ERROR, bent])
    else:
        late = (told.times.min() - QUICKEST) / TIME_ERROR, (told.times.max() - SLOWEST) / TIME_ERROR
        rows = np.array([*told.overshoot / OVERSHOOT_ERROR, *late, bent])
    return np.where(np.isnan(rows), UNREAD, rows)


@app.function(hide_code=True)
def searched(name, simulate, ranges, starts=STARTS, room=True):
    """Least squares of the quoted facts from the best points of a Sobol sequence over the ranges; the ends' x are values."""
    low, high = np.log(list(ranges.values())).T

    def rows(places):
        return np.array([misfit(name, told) for told in facts(np.exp(low + places * (high - low)), simulate)])

    def around(place, width=1e-3):
        """Rows and slopes, of which scipy asks one after the other."""
        if kept.get("at") != place.tobytes():
            away = np.where(place > 0.5, -width, width)
            here = rows(np.vstack([place, place + np.diag(away)]))
            kept.update(at=place.tobytes(), rows=here[0], slopes=(here[1:] - here[0]).T / away)
        return kept

    kept = {}
    points = qmc.Sobol(len(low), seed=SEED).random(LOOKS)
    order = np.argsort(np.sum(rows(points) ** 2, axis=1))
    search = lambda start: least_squares(  # noqa: E731
        lambda x: around(x)["rows"], start, lambda x: around(x)["slopes"], bounds=(0, 1), max_nfev=TURNS
    )
    ends = [search(points[i]) for i in order[:starts]]
    if room:
        near = best(ends).x + NEAR * (2 * points[:starts] - 1)
        ends += [search(start) for start in np.clip(near, 1e-3, 1 - 1e-3)]
    for end in ends:
        end.x = np.exp(low + end.x * (high - low))
    return ends


@app.function(hide_code=True)
def best(ends):
    """The solution that misses the facts least."""
    return min(ends, key=lambda end: end.cost)


@app.function(hide_code=True)
def missed(end):
    """By how many errors a solution misses the fact that it misses most."""
    return float(np.max(np.abs(end.fun)))


@app.function(hide_code=True)
def good(ends):
    """Those that meet every fact within its error."""
    return [end for end in ends if missed(end) < 1]


@app.function(hide_code=True)
def left(ends, which):
    """The least and the most of one number among the solutions that meet every fact (the best one if none does)."""
    values = [end.x[which] for end in good(ends) or [best(ends)]]
    return min(values), max(values)


@app.function(hide_code=True)
def room_rows(found):
    """A row of the table for each number: where it was looked for, and from where to where it meets the facts."""
    names = {"f_s": "f_s, friction at rest", "ratio": "ratio", "v_s": "v_s [m/s]", "valve": "valve [s]",
             "lightest": "lightest load / strongest pull"}  # fmt: skip
    rooms = {name: [left(ends, k) for k in range(len(BRAID))] for name, ends in found.items()}
    rows = [f"| {names[name]} | {spread(BRAID[name])} | {spread(rooms['rayon'][k])} | {spread(rooms['iron'][k])} |"
            for k, name in enumerate(BRAID)]  # fmt: skip
    rows.insert(
        2, f"| f_s x ratio, friction when fast | | {spread(fast(found['rayon']))} | {spread(fast(found['iron']))} |"
    )
    return "\n    ".join(rows)


@app.function(hide_code=True)
def fast(ends):
    """Friction when fast, f_s x ratio, of every solution that meets the facts."""
    return [float(end.x[0] * end.x[1]) for end in good(ends) or [best(ends)]]


@app.function(hide_code=True)
def spread(values, digits=2):
    """The least and the most of some values."""
    return f"{min(values):.{digits}g} to {max(values):.{digits}g}"


@app.function(hide_code=True)
def responses(told):
    """Figure 15: step responses of both muscles."""
    figure, panels = plt.subplots(1, 2, figsize=(9.4, 3.4), sharey=True, layout="constrained")
    for axes, (name, seen) in zip(panels, told.items(), strict=True):
        for mass, x, colour in zip(MASSES, seen.steps, (BLUE, SKY, GREEN, ORANGE, VERMILION), strict=True):
            axes.plot(STEP_TIME, 1e3 * x, color=colour, label=f"{mass:g} kg")
        axes.set(title=f"{name}: a/F0 = {seen.curvature:.2f}, overshoot up to {100 * max(seen.overshoot):.0f} %",
                 xlabel="time [s]")  # fmt: skip
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("shortening [mm]")
    panels[1].legend(fontsize=8, frameon=False)
    return figure


@app.function(hide_code=True)
def friction_over_speed(found):
    """Friction over the load of the strands, for every solution that meets the facts."""
    figure, axes = plt.subplots(figsize=(6.2, 3.2), layout="constrained")
    speed = np.linspace(0, 1, 200)
    for (name, ends), colour in zip(found.items(), (BLUE, VERMILION), strict=True):
        for number, (size, ratio, scale, *_) in enumerate(end.x for end in good(ends)):
            label = None if number else name
            axes.plot(speed, size * np.asarray(textile.kinetic_factor(speed, ratio, scale)), color=colour, label=label)
    axes.axhline(0, color=GREY, linewidth=0.6)
    axes.set(xlabel="speed [m/s]", ylabel="friction coefficient (36)")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False)
    return figure


@app.function(hide_code=True)
def rival_step(load, damping, stiffness, tau):
    """Step response (m) of Reynolds' muscle through the same valve, by its three poles."""
    mass, surplus = load / g, STRONGEST - load
    root = jnp.sqrt(damping**2 - 4 * mass * stiffness + 0j)
    p = jnp.stack([-1 / tau + 0j, (root - damping) / (2 * mass), -(root + damping) / (2 * mass)])[:, None]
    slope = tau * (mass * p**2 + damping * p + stiffness) + (tau * p + 1) * (2 * mass * p + damping)
    time = jnp.maximum(STEP_TIME - lifts(load, tau), 0.0)
    return surplus / stiffness + jnp.sum(jnp.real(surplus / (p * slope) * jnp.exp(p * time)), axis=0)


@app.function(hide_code=True)
@jax.jit
def rival_simulated(many):
    """The same of Reynolds' muscle: a row of `many` is damping (N s/m), stiffness (N/m), valve (s), lightest load."""

    def one(values):
        damping, stiffness, tau, lightest = values
        steps = jax.vmap(lambda load: rival_step(load, damping, stiffness, tau))(jnp.asarray(MASSES * g))
        loads = release_loads(lightest)
        rest = reynolds.rest_position(loads, STRONGEST, stiffness)
        way = lambda end, load: reynolds.free_motion(RELEASE_TIME, 0.0, end, load / g, damping, stiffness)  # noqa: E731
        ways = jax.vmap(way)(rest, loads)
        return steps, loads, jnp.max(jnp.diff(ways, axis=1), axis=1) / RELEASE_TIME[1]

    return jax.vmap(one)(many)


@app.function(hide_code=True)
def sentence(found, same_loads, told, rival):
    """The answer: every number, and every verdict, out of the results."""
    rayon, iron = (dict(zip(BRAID, (left(found[name], k) for k in range(len(BRAID))), strict=True)) for name in QUOTED)
    quick = {name: fast(found[name]) for name in QUOTED}
    meets = {name: "meets" if missed(best(found[name])) < 1 else "does not meet" for name in QUOTED}
    ends = {name: best(rival[name]) for name in QUOTED}
    rivals = {name: "meets" if missed(ends[name]) < 1 else "does not meet" for name in QUOTED}
    bent = {name: facts(ends[name].x[None], rival_simulated)[0].curvature for name in QUOTED}
    within = "inside" if rayon["ratio"][0] <= RATIO <= rayon["ratio"][1] else "outside"
    verdict = "meets them too" if missed(same_loads) < 1 else "does not meet them"
    return f"""
**Friction when fast.** A friction that grows with speed {meets["rayon"]} every fact quoted of the rayon muscle: no
overshoot (at most {100 * max(told["rayon"].overshoot):.1f} % of the way), {min(told["rayon"].times):.2f} to
{max(told["rayon"].times):.2f} s, a/F0 = {told["rayon"].curvature:.3f}. The same law {meets["iron"]} those of iron: overshoots
of {100 * min(told["iron"].overshoot):.0f} to {100 * max(told["iron"].overshoot):.0f} %, a/F0 = {told["iron"].curvature:.2f}. What
differs is friction when fast, f_s x ratio: {spread(quick["rayon"])} in rayon, {spread(quick["iron"])} in iron.

- Rayon: {len(good(found["rayon"]))} of {2 * STARTS} searches meet all facts. They agree on friction when fast, not on its parts: at
  rest {spread(rayon["f_s"])}, ratio {spread(rayon["ratio"])}, v_s {spread(rayon["v_s"])} m/s, valve {spread(rayon["valve"])} s.
  The review's ratio of {RATIO} lies {within} what was found.
- Iron: {len(good(found["iron"]))} of {2 * STARTS} searches meet all facts, with a friction that rises or falls: ratio
  {spread(iron["ratio"])}, at rest {spread(iron["f_s"])}. Its a/F0 says how heavy the lightest load was, {spread(iron["lightest"])}
  of the strongest pull, and nothing of viscosity. From loads like rayon's ({spread(rayon["lightest"])}) this law
  {verdict} (worst by {missed(same_loads):.1f} errors).
- Reynolds' linear muscle (41) {rivals["rayon"]} the facts of rayon (worst by {missed(ends["rayon"]):.1f} errors, a/F0 =
  {bent["rayon"]:.2f}), and behind the same valve {rivals["iron"]} those of iron (worst by {missed(ends["iron"]):.1f} errors).
- What would tell: loops at two constant speeds, in which inertia has no part.
"""


if __name__ == "__main__":
    app.run()
