import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium")

with app.setup(hide_code=True):
    import marimo as mo
    import matplotlib.pyplot as plt
    import numpy as np
    from scipy.constants import g
    from scipy.optimize import brentq, least_squares

    from fitting import use_64_bit
    from fitting.report import BLUE, GREEN, GREY, ORANGE, VERMILION
    from mckibben_jax import CoulombFriction, IdealCylinder, Muscle, model, release
    from mckibben_jax.laws import biology, braid, textile

    use_64_bit()

    RAYON, IRON = biology.CURVATURE_RAYON, biology.CURVATURE_IRON
    LIGHTEST = (0.05, 0.1, 0.2)  # lightest load over the heaviest that moves
    HEAVIEST = 0.95
    PULL, STROKE, FRICTION = 800.0, 0.09, 40.0  # N, m, N: none of them changes a/F0
    RATIOS = (7.0, 2.0)  # fast over static friction: what the review needed, what textiles have


@app.cell
def _(answer):
    if not mo.running_in_notebook():
        print(answer)
    mo.md(f"# Is a McKibben muscle a Hill muscle?\n\n{answer}")
    return


@app.cell
def _(alike, braided, friction, released):
    answer = sentence(released, alike, braided, friction)
    return (answer,)


@app.cell
def _():
    mo.md("""
    ## Figure 18: velocity over load, rayon and iron

    Hill's hyperbola with the two values of a/F0 that the review reads from quick releases, and (dots) the speed of a
    linear spring with constant friction and the load's inertia at the instant without acceleration (47). There is no
    viscosity in it: it goes as (1 - w)/sqrt(w), w the load over the heaviest that moves. Each set of dots ends at the
    lightest load from which a fit of Hill's law would read the same a/F0.
    """)
    return


@app.cell
def _(alike):
    velocity_over_load(alike)
    return


@app.cell
def _():
    released = {lightest: hill_fit(loads(lightest), release_speed(loads(lightest))) for lightest in LIGHTEST}
    alike = {name: lightest_load(curvature) for name, curvature in (("rayon", RAYON), ("iron", IRON))}
    return alike, released


@app.cell
def _():
    mo.md("""
    ## The same with a braid in place of a linear spring

    Quick releases of an ideal cylinder (30 cm, 7 mm, 20 deg, 5 bar) with Coulomb friction, solved in time: the highest
    speed under each load.
    """)
    return


@app.cell
def _():
    at = np.linspace(0.1, HEAVIEST, 12)
    peaks = np.array([peak_speed(w) for w in at])
    braided = hill_fit(at, peaks)
    return at, braided, peaks


@app.cell
def _(at, braided, peaks):
    braid_releases(at, peaks, braided)
    return


@app.cell
def _():
    mo.md("""
    ## Figure 19: kinetic friction in place of Hill's viscous force

    What shortening costs by Hill's law (45), a/F0 = 0.12, and the kinetic friction of textiles (48) fitted to it.
    """)
    return


@app.cell
def _():
    friction = {ratio: friction_fit(ratio) for ratio in RATIOS}
    return (friction,)


@app.cell
def _(friction):
    viscous_and_kinetic(friction)
    return


@app.function
def loads(lightest):
    """Fifty loads over the heaviest that moves."""
    return np.linspace(lightest, HEAVIEST, 50)


@app.function
def release_speed(w):
    """Speed without acceleration after a release (47), m/s."""
    load = w * (PULL - FRICTION)
    return np.array(biology.release_velocity(load, PULL, STROKE, FRICTION, load / g))


@app.function
def hill_fit(w, speed):
    """a/F0 of Hill's law fitted to speeds, its V_max, and the rms misfit as a share of the rms speed."""
    scale = np.sqrt(np.mean(speed**2))

    def misfit(p):
        return (p[0] * np.array(biology.hill_velocity_ratio(w, p[1])) - speed) / scale

    found = least_squares(misfit, [speed[0], 0.3])
    return float(found.x[1]), float(found.x[0]), float(np.sqrt(np.mean(found.fun**2)))


@app.function
def lightest_load(curvature):
    """The lightest load from which a fit of Hill's law to eq 47 reads this a/F0."""
    return brentq(lambda low: hill_fit(loads(low), release_speed(loads(low)))[0] - curvature, 0.01, 0.8, xtol=1e-5)


@app.function
def peak_speed(w, pressure=5e5):
    """Highest speed of a braid with Coulomb friction that lifts a share w of what it can, m/s."""
    length, radius, angle, coefficient = 0.3, 0.007, np.radians(20), 0.015
    lifting = model(Muscle(length, radius, angle), IdealCylinder(), CoulombFriction(f_s=coefficient))
    rubbing = textile.coulomb_friction(pressure * braid.contact_surface(0.0, length, radius, angle), coefficient)
    heaviest = braid.ideal_force(0.0, pressure, radius, angle) - rubbing
    time = np.linspace(0, 0.5, 501)
    contraction = np.array(release(lifting, load=w * heaviest, pressure=pressure, times=time))
    return float(np.max(np.gradient(length * contraction, time)))


@app.function
def friction_fit(ratio):
    """Kinetic friction (48) fitted to Hill's viscous force (45) over F0: static part, speed scale over V_max, rms."""
    speed = np.linspace(0, 1, 201)
    viscous = np.array(biology.hill_viscous_force(speed, 1.0, RAYON, RAYON))

    def misfit(p):
        return p[0] * np.array(textile.kinetic_factor(speed, ratio, p[1])) - viscous

    found = least_squares(misfit, [0.2, 0.2])
    return float(found.x[0]), float(found.x[1]), float(np.sqrt(np.mean(found.fun**2)))


@app.function
def sentence(released, alike, braided, friction):
    """The answer: every number, and every verdict, out of the results."""
    curvatures = ", ".join(f"{fit[0]:.2f}" for fit in released.values())
    worst = max(fit[2] for fit in released.values())
    seven, two = (100 * friction[ratio][2] for ratio in RATIOS)
    stands_in = "only if" if two > 2 * seven else "whether or not"
    return f"""
The curve of velocity over load cannot tell. **Inertia and constant friction alone**, without any viscosity, give speeds
that Hill's law fits to {100 * worst:.0f} % or better, with a/F0 = {curvatures} when the lightest load is
{", ".join(map(str, LIGHTEST))} of the heaviest.

- The review's a/F0 = {RAYON} (rayon) and {IRON} (iron) are what a lightest load of {alike["rayon"]:.2f} and
  {alike["iron"]:.2f} of the heaviest would give. A braid (eq 10) with Coulomb friction, from 0.1, gives
  {braided[0]:.2f}, to {100 * braided[2]:.0f} %.
- Kinetic friction (48) stands in for Hill's viscous force (45) {stands_in} it rises much more than textiles do: to
  {seven:.1f} % rms of F0 if it rises sevenfold with speed, to {two:.1f} % if twofold.
- What would tell: ramps at constant speed, in which inertia has no part.
"""


@app.function
def velocity_over_load(alike):
    """Figure 18, and what eq 47 alone gives."""
    figure, panels = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    w = np.linspace(0, 1, 200)
    for axes, name, curvature in zip(panels, alike, (RAYON, IRON), strict=True):
        axes.plot(w, biology.hill_velocity_ratio(w, curvature), color=BLUE, label=f"Hill, a/F0 = {curvature}")
        some = loads(alike[name])[::3]
        top = hill_fit(loads(alike[name]), release_speed(loads(alike[name])))[1]
        axes.plot(some, release_speed(some) / top, "o", color=VERMILION, markersize=4, label="inertia and Coulomb (47)")
        axes.set(title=name, xlabel="load / heaviest load", ylabel="V / V_max", ylim=(0, 1.05))
        axes.legend(fontsize=8)
    return figure


@app.function
def braid_releases(w, speed, fit):
    """Speeds of the braid with Hill's law through them."""
    figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
    fine = np.linspace(w[0], 1, 200)
    axes.plot(w, speed, "o", color=VERMILION, label="ideal braid, Coulomb friction")
    axes.plot(fine, fit[1] * biology.hill_velocity_ratio(fine, fit[0]), color=BLUE, label=f"Hill, a/F0 = {fit[0]:.2f}")
    axes.set(xlabel="load / heaviest load", ylabel="highest speed [m/s]", ylim=(0, None))
    axes.legend(fontsize=8)
    return figure


@app.function
def viscous_and_kinetic(friction):
    """Figure 19(b)."""
    speed = np.linspace(0, 1, 201)
    figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
    axes.plot(speed, biology.hill_viscous_force(speed, 1.0, RAYON, RAYON), color=GREY, linewidth=3, label="Hill (45)")
    for (ratio, (size, scale, left)), colour in zip(friction.items(), (GREEN, ORANGE), strict=True):
        curve = size * textile.kinetic_factor(speed, ratio, scale)
        axes.plot(speed, curve, color=colour, label=f"friction (48), ratio {ratio:.0f}: {100 * left:.1f} % rms")
    axes.set(xlabel="speed / V_max", ylabel="force lost / F0", ylim=(0, 1.05))
    axes.legend(fontsize=8)
    return figure


if __name__ == "__main__":
    app.run()
