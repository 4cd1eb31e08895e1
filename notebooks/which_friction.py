import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium")

with app.setup(hide_code=True):
    import dataclasses

    import jax.numpy as jnp
    import marimo as mo
    import matplotlib.pyplot as plt
    import numpy as np
    from scipy import stats

    from fitting import example_data, fit, read_experiment, use_64_bit
    from fitting.problem.thinning import thinned
    from fitting.report import BLUE, GREEN, GREY, ORANGE, VERMILION
    from fitting.shipped import shipped_folder
    from mckibben_jax import BladderNeoHookean, IdealCylinder, KineticFriction, TextileFriction
    from mckibben_jax.laws import braid, textile

    use_64_bit()

    BAR, ANGLE = 1e5, np.radians(20)
    STRAND = {"strand_modulus": 2e9, "strand_poisson": 0.4}  # change the size of Hertz contacts, not how they grow
    SCHULTE, COULOMB, HERTZ, SHEAR = "Schulte (33)", "Coulomb (36)", "Hertz (36, 38, 39)", "shear of Hertz's area"
    COLOURS = {SCHULTE: BLUE, COULOMB: ORANGE, HERTZ: VERMILION, SHEAR: GREEN}
    SLOW, FAST = slice(0, 5), slice(5, 10)  # runs of rayon20, 1 to 5 bar each


@app.cell
def _(answer):
    if not mo.running_in_notebook():
        print(answer)
    mo.md(f"# Which friction: does it grow as the pressure, faster, or slower?\n\n{answer}")
    return


@app.cell
def _(anywhere, beta, misfits, powers, through_one):
    answer = sentence(powers, through_one, anywhere, beta, misfits)
    return (answer,)


@app.cell
def _():
    mo.md("""
    ## How each law grows with pressure

    At a held contraction the surface, the length and the number of crossings are fixed, and each law is a power of the
    pressure. Schulte: the whole cylinder rubs. Coulomb: the contact surface. Hertz as the review has it: the surface
    over a scale factor that is itself a power, P^(1/3). Shear of Hertz's area: a strength per area of round contacts.
    """)
    return


@app.cell
def _():
    powers = {law: growth(lambda p, law=law: size(law, p, 0.1)) for law in COLOURS}
    return (powers,)


@app.cell
def _():
    mo.md("""
    ## The widths that the review quotes

    Rayon, 20 deg, contraction 0.1: the width of the hysteresis at 2 to 5 bar over that at 1 bar. A straight line
    in logarithms gives the exponent: through the point at 1 bar, or with that point as uncertain as the others.
    """)
    return


@app.cell
def _():
    bars, ratios = np.loadtxt(
        shipped_folder() / "tondu2012_tables/hysteresis_width_ratios.csv", delimiter=",", skiprows=3
    ).T
    through_one, anywhere = exponent(bars, ratios, free_level=False), exponent(bars, ratios, free_level=True)
    return anywhere, bars, ratios, through_one


@app.cell
def _(bars, powers, ratios, through_one):
    quoted_widths(bars, ratios, powers, through_one)
    return


@app.cell
def _():
    mo.md("""
    ## Loops of `rayon20`

    Loops of a simulated muscle whose law is not told here, at five pressures and two speeds. Half the difference of
    the two directions at equal contraction is the friction alone, whatever the gas, the rubber and the ends do. Then
    the whole model is fitted at once, so that the exponent carries the errors of everything else.
    """)
    return


@app.cell
def _():
    muscle = read_experiment(example_data("rayon20"))
    loops = muscle.recordings[0]
    contractions = np.linspace(0.09, 0.17, 9)  # both loops, the large and the small, pass here
    pressures = np.array([run.pressure[0] for run in loops.runs])
    halves = np.array([half_width(run, contractions) for run in loops.runs])
    return contractions, halves, loops, muscle, pressures


@app.cell
def _(loops, muscle):
    few = thinned(dataclasses.replace(muscle, recordings=(loops,)), 1500)
    effects = (IdealCylinder(), BladderNeoHookean(), TextileFriction(), KineticFriction())
    fitted = fit([few], effects, starts=2)
    assert fitted.converged
    at = fitted.free.index("textile_friction.beta")
    # the loops are computed: no instrument has read them
    beta = float(fitted.vector[fitted.layout.at(fitted.free)[at]]), float(fitted.repeatable[at, at] ** 0.5)
    return (beta,)


@app.cell
def _(beta, contractions, halves, pressures):
    states = pressures[:, None], contractions[None, :]
    textile_law = textile.power_law_friction(size(COULOMB, *states), 1.0, beta[0])
    misfits = {law: misfit(size(law, *states), halves) for law in COLOURS} | {
        "textile (40)": misfit(textile_law, halves)
    }
    return (misfits,)


@app.cell
def _(beta, contractions, halves, pressures):
    own_widths(pressures, halves, contractions, beta[0])
    return


@app.function
def size(law, pressure, contraction, length=0.3, radius=0.007, angle=ANGLE):
    """Friction by a law with coefficient 1 (shear: 1 Pa), N, of a muscle like the review's."""
    surface = braid.contact_surface(contraction, length, radius, angle)
    if law == SCHULTE:
        wide, long = radius * braid.radius_ratio(contraction, angle), length * (1 - contraction)
        return textile.schulte_friction(pressure, wide, long, 1.0)
    if law == COULOMB:
        return textile.coulomb_friction(surface * pressure, 1.0)
    if law == HERTZ:
        return textile.hertz_friction(pressure, surface, 1.0, *STRAND.values())
    width = 1e-3  # m; drops out: contacts of width^2 each cover the surface
    return textile.sphere_contact_area(pressure, width, *STRAND.values()) * surface / width**2


@app.function
def growth(law, at=3 * BAR):
    """The power of the pressure with which a law grows."""
    return float(braid.slope(lambda x: jnp.log(law(jnp.exp(x))), np.log(at)))


@app.function
def exponent(pressures, widths, free_level):
    """Exponent of widths over pressures and its standard error, by a line in logarithms."""
    x, y = np.log(pressures / pressures[0]), np.log(widths / widths[0])
    if not free_level:
        x, y = x[1:], y[1:]
    columns = np.stack([x, np.ones_like(x)], axis=1) if free_level else x[:, None]
    found, *_ = np.linalg.lstsq(columns, y, rcond=None)
    freedom = len(y) - columns.shape[1]
    variance = np.sum((y - columns @ found) ** 2) / freedom
    error = np.sqrt(variance * np.linalg.inv(columns.T @ columns)[0, 0])
    return float(found[0]), float(error), float(stats.t.ppf(0.975, freedom))


@app.function
def half_width(run, contractions):
    """Half the difference of elongation and contraction at equal contraction, N: four branches, a quartic each."""
    branches = [(run.half == half) & (run.weight > 0) for half in range(4)]
    fits = [np.polyval(np.polyfit(run.contraction[b], run.measured[b], 4), contractions) for b in branches]
    return (fits[1] + fits[3] - fits[0] - fits[2]) / 4


@app.function
def misfit(shape, halves):
    """Rms misfit of a law to the half widths, % of the widest, with the best coefficient at each speed."""
    left = []
    for runs in (SLOW, FAST):
        mine, measured = np.asarray(shape)[runs], halves[runs]
        left.append(measured - mine * np.sum(mine * measured) / np.sum(mine**2))
    return float(100 * np.sqrt(np.mean(np.square(left))) / halves.max())


@app.function
def verdict(found, power):
    """Whether a power is ruled out by an exponent, its error and Student's factor."""
    value, error, needed = found
    away = abs(power - value) / error
    return f"{away:.{away < 10:d}f} standard errors away" + (", ruled out" if away > needed else ", **possible**")


@app.function
def sentence(powers, through_one, anywhere, beta, misfits):
    """The answer: every number, and every verdict, out of the results."""
    ruled = "; ".join(f"{law}, P^{power:.2f}: {verdict(through_one, power)}" for law, power in powers.items())
    clear = abs(powers[SHEAR] - beta[0]) > 3 * beta[1]
    left = ", ".join(f"{law} {value:.1f} %" for law, value in misfits.items())
    told = "tell" if "ruled" in verdict(anywhere, powers[SHEAR]) else "do not tell"
    return f"""
Slower: the review's widths at 1 to 5 bar grow as **P^{through_one[0]:.2f} +/- {through_one[1]:.2f}**
(P^{anywhere[0]:.2f} +/- {anywhere[1]:.2f} if the width at 1 bar is as uncertain as the others). {ruled}.

- Five widths {told} the textile law (40) from the shear of Hertz's area (by the second line, P^{powers[SHEAR]:.2f} is
  {verdict(anywhere, powers[SHEAR])}).
- The loops of `rayon20`, fitted with gas, rubber and speed at once, give beta = {beta[0]:.4f} +/- {beta[1]:.4f}: there
  2/3 is {"ruled out" if clear else "possible"}. What the laws leave of their widths, in % of the widest: {left}.
"""


@app.function
def quoted_widths(bars, ratios, powers, found):
    """The quoted ratios and the laws."""
    figure, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
    for law, power in powers.items():
        style = "--" if law == COULOMB else "-"  # Schulte and Coulomb grow alike
        axes.loglog(bars, bars**power, style, color=COLOURS[law], label=f"{law}: P^{power:.2f}")
    axes.loglog(bars, bars ** found[0], ":", color="black", label=f"textile (40): P^{found[0]:.2f}")
    axes.loglog(bars, ratios, "o", color=GREY, label="quoted")
    axes.set_xticks(bars, [f"{bar:.0f}" for bar in bars], minor=False)
    axes.set_yticks([1, 2, 3, 5, 8], ["1", "2", "3", "5", "8"])
    axes.minorticks_off()
    axes.set(xlabel="pressure [bar]", ylabel="width / width at 1 bar")
    axes.legend(fontsize=8)
    return figure


@app.function
def own_widths(pressures, halves, contractions, beta):
    """Half widths of the loops: over pressure at 0.13, and over contraction, divided by the law that was found."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    middle = len(contractions) // 2
    for runs, colour, words in ((SLOW, BLUE, "slow"), (FAST, VERMILION, "fast")):
        bar, width = pressures[runs] / BAR, halves[runs, middle]
        left.loglog(bar, width, "o", color=colour, label=f"{words} loops")
        left.loglog(bar, width[0] * bar**beta, "-", color=colour, linewidth=1)
        left.loglog(bar, width[0] * bar, ":", color=colour, linewidth=1)
        load = np.array(size(COULOMB, pressures[runs, None], contractions[None, :]))
        scaled = halves[runs] / np.array(textile.power_law_friction(load, 1.0, beta))
        right.plot(contractions, scaled.T, color=colour, linewidth=1)
    left.plot([], [], "-", color=GREY, label=f"P^{beta:.2f}")
    left.plot([], [], ":", color=GREY, label="P")
    left.set_xticks([1, 2, 3, 4, 5], ["1", "2", "3", "4", "5"])
    left.set_yticks([20, 50, 100], ["20", "50", "100"])
    left.minorticks_off()
    left.set(xlabel="pressure [bar]", ylabel="half width at 0.13 [N]")
    left.legend(fontsize=8)
    right.set(xlabel="contraction", ylabel="half width / textile law", ylim=(0, None))
    return figure


if __name__ == "__main__":
    app.run()
