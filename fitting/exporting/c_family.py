"""Draws of the parameters in a header of C99: a table of them, and the choice of one."""

from string import Template

from fitting.exporting.draws import Draws, parameters_of
from mckibben_jax.model import Model

LAWS = ("start", "step", "parts", "force", "linearised")


def family_in_c(whole: Model, name: str, draws: Draws) -> str:
    """The table, the function that chooses a draw, and the laws with the parameters of the chosen one."""
    rows = [parameters_of(whole, draws.names), *draws.values.tolist()]
    now = ", ".join(f"{name}_now[{at}]" for at in range(len(draws.names)))
    return _FAMILY.substitute(
        n=name,
        N=name.upper(),
        draws=len(draws.values),
        parameters=len(draws.names),
        named="\n".join(
            f" *   {at}: {each} ({unit})" for at, (each, unit) in enumerate(zip(draws.names, draws.units, strict=True))
        ),
        table=",\n".join(f"    {{{', '.join(f'MK_C({value!r})' for value in row)}}}" for row in rows),
        laws="\n".join(f"#define {name}_law_{law}(...) {name}_drawn_{law}({now}, __VA_ARGS__)" for law in LAWS),
    )


def undefined_in_c(name: str) -> str:
    """What ends the definitions that only the header itself needs."""
    return "".join(f"#undef {name}_law_{law}\n" for law in LAWS)


_FAMILY = Template("""
/* ---- draws of the parameters, SI. The first row holds the fitted values, the next ones draw 0, 1, 2, ...
$named
 */
#define ${N}_DRAWS $draws
#define ${N}_PARAMETERS $parameters
static const ${n}_real ${n}_parameters[${N}_DRAWS + 1][${N}_PARAMETERS] = {
$table
};

#ifndef ${N}_LOCAL
#define ${N}_LOCAL /* define it as _Thread_local where several threads use different draws */
#endif
static ${N}_LOCAL const ${n}_real *${n}_now = ${n}_parameters[0];

/* From here on every function is that of this draw, 0 to ${N}_DRAWS - 1; of the fitted values for any other number.
 * This is the only place where parameters are chosen. A state belongs to the draw that it was made with: begin anew. */
static inline void ${n}_use(int draw) {
    ${n}_now = ${n}_parameters[draw >= 0 && draw < ${N}_DRAWS ? draw + 1 : 0];
}
$laws
""")
