"""Damage as it happens to files, and as somebody who means harm would do it."""

from random import Random

from .trees import retyped

TOKENS = tuple(
    token.encode() if isinstance(token, str) else token
    for token in (
        *",;\t\"'[]{}()=#.-+*/^%_ :|\\<>&!?@~`$\r\n",
        "\r\n", '""', "'''", '"""', "nan", "-nan", "NaN", "inf", "-inf", "1e999", "-1e999", "1e-999", "1e308", "1e5",
        "0", "-0", "00", "-1", "0x10", "1_000", "1,5", "1.234.567", "1.234,5", "9" * 25, "9" * 5000, "1e",
        "--1", "１２",
        "true", "false", "null", "None", "NA", "#N/A", "1979-05-27", "07:32:00", "\ufeff", "\u202e", "\u2212",
        "é", "°", "±",
        "µ", "\u2028", "\x00", "\x1a", "\x1b[2J", b"\xff", b"\xff\xfe", b"\xc3\x28", "../", "/dev/zero",
        "/etc/passwd",
        "<script>alert(1)</script>", "'; DROP TABLE block; --", "__import__('os').system('true')", "mm", "bar",
        "Pa", "kN",
        "dB", "degC", "furlong", "mm**9**9", "9**9**9**9", "10**10**10", "(" * 50, "[" * 3000, "-" * 3000,
        "a." * 3000, "x" * 9999,
        "[muscle]", "[[recording]]", "[[effect]]", "[[constraint]]", "define = ", "format = 2", "file = ", "test = ",
        " (0..1)", "(-1..1)", ", q = 1 N (0..2)", "sin(", "exp(", "sqrt(", "max(", "lambda: 0",
        "x if x else x", "x[0]", "x.real",
        "min(x, x)", "x**x", "0/0", "tan(pi/2)", "\n\n", ",,", ";;", "time [s]", "force [N]", "run", "branch",
        "inflate",
    )
)  # fmt: skip


def damaged(good: bytes, random: Random, tree: bool = False, most: int = 4) -> bytes:
    """A good input with one to `most` pieces of damage; where it is a `tree`, in half of the cases to that."""
    if tree and random.random() < 0.5:
        return retyped(good, random)
    content = bytearray(good)
    for _ in range(random.choice((1, 1, 1, random.randint(1, most)))):
        random.choice(KINDS)(content, random)
    return bytes(content)


def _span(content: bytearray, random: Random, longest: int = 30) -> slice:
    start = random.randint(0, len(content))
    return slice(start, min(start + random.randint(1, longest), len(content)))


def _insert(content: bytearray, random: Random) -> None:
    at = random.randint(0, len(content))
    content[at:at] = random.choice(TOKENS)


def _replace(content: bytearray, random: Random) -> None:
    content[_span(content, random, 6)] = random.choice(TOKENS)


def _delete(content: bytearray, random: Random) -> None:
    del content[_span(content, random)]


def _repeat(content: bytearray, random: Random) -> None:
    span = _span(content, random, 200)
    content[span] = bytes(content[span]) * random.choice((2, 2, 2, 3, 50))


def _byte(content: bytearray, random: Random) -> None:
    if content:
        content[random.randrange(len(content))] = random.randrange(256)


def _digit(content: bytearray, random: Random) -> None:
    """One digit becomes another, or another sign: what a reader must not pass over."""
    digits = [at for at, byte in enumerate(content) if 48 <= byte <= 57]
    if digits:
        at = random.choice(digits)
        content[at : at + 1] = random.choice((b"0", b"1", b"7", b"9", b"-", b".", b",", b"e", b"", b" ", b"88"))


def _value(content: bytearray, random: Random) -> None:
    """A whole number or word becomes something else."""
    span = _span(content, random, 1)
    start = stop = span.start
    while start > 0 and chr(content[start - 1]).isalnum():
        start -= 1
    while stop < len(content) and chr(content[stop]).isalnum():
        stop += 1
    content[start:stop] = random.choice(TOKENS)


def _swap(content: bytearray, random: Random) -> None:
    one, other = _span(content, random), _span(content, random)
    if one.stop <= other.start:
        first, second = bytes(content[one]), bytes(content[other])
        content[other], content[one] = first, second


def _swap_lines(content: bytearray, random: Random) -> None:
    lines = bytes(content).split(b"\n")
    i, j = random.randrange(len(lines)), random.randrange(len(lines))
    lines[i], lines[j] = lines[j], lines[i]
    content[:] = b"\n".join(lines)


def _drop_line(content: bytearray, random: Random) -> None:
    lines = bytes(content).split(b"\n")
    del lines[random.randrange(len(lines))]
    content[:] = b"\n".join(lines)


def _cut(content: bytearray, random: Random) -> None:
    del content[random.randint(0, len(content)) :]


def _encode(content: bytearray, random: Random) -> None:
    text = bytes(content).decode("utf-8", "replace")
    content[:] = text.encode(random.choice(("utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-8-sig")))


KINDS = (_insert, _replace, _delete, _repeat, _byte, _digit, _digit, _value, _value, _swap, _swap_lines,
         _drop_line, _cut,
         _encode)  # fmt: skip
