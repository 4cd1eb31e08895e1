"""Formulas as the program writes them, "F = pi r0^2 P [a (1 - eps)^2 - b]", typeset as MathML.

Browsers draw MathML by themselves: nothing is fetched, and no script runs. The converters from such text that exist
are not kept any more (asciimathml stops at Python 3.9, py-asciimath replaces the parser library that others need).
"""

import html
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass

GREEK = {
    "alpha": "α", "beta": "β", "eps": "ε", "eta": "η", "theta": "θ", "lambda": "λ", "mu": "μ", "nu": "ν", "pi": "π",
    "sigma": "σ", "tau": "τ",
}  # fmt: skip
FUNCTIONS = ("sin", "cos", "tan", "atan", "sqrt", "exp", "ln", "max", "sign")
SIGNS = {"->": "→", "<=": "≤", "-": "−", "~": "≈", "int": "∫", "sum": "∑"}
SHORT = {"lz": "l_z", "EA": "E A", "a_over_F0": "a/F0"}  # names that are formulas
CLOSING = {"(": ")", "[": "]", "{": "}", "|": "|"}
TOKEN = re.compile(r"\s*(?:(->|<=|[-+=,~<>/^()\[\]{}|])|(\d+(?:\.\d+)?)|([A-Za-z]\w*(?:'+(?:_\w+)?)?\*?)|(\S))")
NAME = re.compile(r"([A-Za-z]+)(\d+)?(?:_(\w+))?")


class NotAFormula(ValueError):
    """The text holds words; it is shown as it stands."""


@dataclass(frozen=True)
class Token:
    """A sign, a number or a name, and whether it stands directly behind what comes before."""

    text: str
    kind: str  # sign, number, name
    close: bool


def tokens(text: str) -> Iterator[Token]:
    """The signs, numbers and names of a formula; NotAFormula where there is anything else."""
    at = 0
    while found := TOKEN.match(text, at):
        kind = ("sign", "number", "name", "")[(found.lastindex or 0) - 1]
        if not kind:
            raise NotAFormula(text)
        yield Token(found[0].strip(), kind, not found[0][0].isspace())
        at = found.end()


def names_in(text: str) -> tuple[str, ...]:
    """The names that a formula uses, each once, without functions and pi; of `dP_m/dt` those differentiated."""
    found = [_undifferentiated(token.text) for token in tokens(text) if token.kind == "name"]
    return tuple(dict.fromkeys(name for name in found if name not in (*FUNCTIONS, *SIGNS, "d", "pi")))


def statements(text: str) -> list[str]:
    """The parts of a formula between commas that stand in no bracket."""
    return [part for part in re.split(r",\s+(?![^([{]*[)\]}])", text) if part]


def mathml(text: str, names: Collection[str] = ()) -> str:
    """A formula as a `<math>` element; `names` are words that are names here. NotAFormula where it holds others."""
    parser = _Parser(list(tokens(text)), frozenset(names), text)
    row = parser.row(None)
    return f'<math displaystyle="true">{row}</math>'


def formula_html(text: str, names: Collection[str] = ()) -> str:
    """A formula as MathML, or as it stands where it holds words."""
    try:
        return mathml(text, names)
    except NotAFormula:
        return f"<code>{html.escape(text)}</code>"


# Parsed ---------------------------------------------------------------------------------------------------------------


class _Parser:
    """Reads tokens from the left: rows of signs and products, products of powers, powers of names and brackets."""

    def __init__(self, read: list[Token], names: frozenset[str], text: str):
        self.read, self.at, self.names, self.text = read, 0, names, text

    @property
    def next(self) -> Token | None:
        """The token that comes next, or None at the end."""
        return self.read[self.at] if self.at < len(self.read) else None

    def is_next(self, *texts: str) -> bool:
        """Whether one of these comes next."""
        return self.next is not None and self.next.text in texts

    def take(self) -> Token:
        """The next token."""
        if self.next is None:
            raise NotAFormula(self.text)
        self.at += 1
        return self.read[self.at - 1]

    def row(self, end: str | None) -> str:
        """Everything up to the closing bracket, which is taken too, or to the end."""
        parts = []
        while self.next is not None and not (end and self.is_next(end)):
            token = self.next
            if token.kind == "sign" and token.text not in CLOSING:
                if token.text in "/^)]}":
                    raise NotAFormula(self.text)
                parts.append(_operator(self.take().text))
                parts += ['<mspace width="1.5em"/>'] if token.text == "," and end is None else []
            else:
                parts.append(self.product())
        if end:
            self.take()
        return _row(parts)

    def product(self) -> str:
        """Factors side by side; what stands before a slash is the numerator, a derivative's alone."""
        factors: list[_Factor] = []
        while self.next is not None and (self.next.kind != "sign" or self.next.text in CLOSING):
            if self.is_next("|") and factors and self.closes_bar():
                break
            factors.append(self.power())
            if self.is_next("/"):
                self.take()
                below = self.power()
                first = len(factors) - 1 if factors[-1].differential and below.differential else 0
                above = factors[first:]
                inner = above[0].bare if len(above) == 1 else _row([factor.beside for factor in above])
                factors[first:] = [_Factor(f"<mfrac>{_row([inner])}{_row([below.bare])}</mfrac>")]
        return _row([factor.beside for factor in factors])

    def closes_bar(self) -> bool:
        """Whether a bar that comes next closes one: an odd number of them was taken."""
        return sum(token.text == "|" for token in self.read[: self.at]) % 2 == 1

    def power(self) -> "_Factor":
        """An atom, its exponent, and what a function is applied to."""
        token = self.next
        factor = self.raised(self.atom())
        applied = self.next is not None and self.next.close and self.next.text in ("(", "[", "{")
        if not applied or token is None or token.kind != "name":
            return factor
        argument = self.atom()
        if token.text == "sqrt":
            return self.raised(_Factor(f"<msqrt>{argument.bare}</msqrt>"))
        return self.raised(_Factor(_row([factor.text, argument.text])))

    def raised(self, factor: "_Factor") -> "_Factor":
        """The factor with its exponent, if one follows."""
        if not self.is_next("^"):
            return factor
        self.take()
        sign = [_operator(self.take().text)] if self.is_next("-") else []
        return _Factor(f"<msup>{_row([factor.text])}{_row([*sign, self.atom().bare])}</msup>")

    def atom(self) -> "_Factor":
        """A number, a name or a bracket."""
        token = self.take()
        if token.text in CLOSING:
            inner = self.row(CLOSING[token.text])
            opened, closed = _operator(token.text), _operator(CLOSING[token.text])
            return _Factor(_row([opened, inner, closed]), inner if token.text != "|" else None)
        if token.kind == "number":
            return _Factor(f"<mn>{token.text}</mn>")
        if token.text == "d" and self.next is not None and self.next.kind == "name":  # d eps
            return _Factor(_row(["<mi>d</mi>", self.atom().text]), differential=True)
        if token.kind == "name" and _undifferentiated(token.text) != token.text:
            return _Factor(_row(["<mi>d</mi>", self.name(token.text[1:])]), differential=True)
        return _Factor(self.name(token.text))

    def name(self, name: str) -> str:
        """One name: Greek, index and primes; NotAFormula for a word that is none."""
        if name in SIGNS:
            return _operator(name)
        if name in SHORT:
            return _Parser(list(tokens(SHORT[name])), self.names, self.text).row(None)
        plain, primes = name.rstrip("*").replace("'", ""), name.count("'")
        found = NAME.fullmatch(plain)
        if not found:
            raise NotAFormula(self.text)
        letter, number, index = found[1], found[2] or "", found[3] or ""
        is_word = len(letter) > 1 and letter.islower() and letter not in GREEK
        if is_word and name not in (*FUNCTIONS, *self.names):
            raise NotAFormula(self.text)
        shown = f"<mi>{html.escape(GREEK.get(letter, letter))}</mi>"
        shown = _row([shown, *["<mo>′</mo>"] * primes]) if primes else shown
        sub, star = GREEK.get(index, number + index), name.endswith("*")
        if sub:
            shown = f"<msub>{shown}<mi>{html.escape(sub)}</mi></msub>"
        return f"<msup>{shown}<mo>*</mo></msup>" if star else shown


@dataclass(frozen=True)
class _Factor:
    """MathML of a factor, and the same without its brackets, for where a bar or an exponent makes them idle."""

    text: str
    inner: str | None = None
    differential: bool = False

    @property
    def bare(self) -> str:
        return self.text if self.inner is None else self.inner

    @property
    def beside(self) -> str:
        """Among other factors: a fraction needs no brackets there."""
        return self.bare if self.bare.startswith("<mfrac>") else self.text


def _undifferentiated(name: str) -> str:
    """`P_m` of `dP_m`; every other name as it is."""
    inner = name[1:]
    found = NAME.fullmatch(inner)
    return inner if name[0] == "d" and found and (len(found[1]) == 1 or found[1] in GREEK) else name


def _operator(text: str) -> str:
    return f"<mo>{html.escape(SIGNS.get(text, text))}</mo>"


def _row(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"<mrow>{''.join(parts)}</mrow>"
