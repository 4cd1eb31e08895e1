"""Damage to what a TOML file says rather than to its letters: a value, key or table becomes something else."""

import copy
import tomllib
from random import Random
from typing import Any

import tomlkit

OTHERS: tuple[Any, ...] = (
    0, 1, -1, 2, 10**12, 10**25, 0.5, -0.5, 1e300, 1e-300, float("nan"), float("inf"), True, False, "", " ", "?", "0",
    "1", "-1", "nan", "5 mm", "5 bar", "20 deg", "1e400 mm", "-3 N", "x" * 5000, "\u001b[2J", "\u0000", "../x",
    "/dev/zero",
    "<b>", "naïve 'quoted' \"name\"", "a\nb", [], [1], ["1 mm", "2 mm"], ["2 mm", "1 mm"], [[]], [{}], {}, {"a": 1},
    {"value": "5 mm"}, {"value": 3, "state": "fixed"}, {"from": "1 mm", "to": "9 mm", "n": 3}, {"pressure": "5 bar"},
    {"best": 3, "by": "force"}, {"kind": "normal", "mean": "1", "sd": "0"}, "all", "force", "loop", "fitted",
    "ideal_cylinder", "screw = A*x, A = 1 N/m (0..2)",
)  # fmt: skip


def retyped(good: bytes, random: Random) -> bytes:
    """A good TOML file with one to three of its values, keys or tables changed, dropped or added."""
    tree = tomllib.loads(good.decode())
    for _ in range(random.choice((1, 1, 2, 3))):
        _change(tree, random)
    return tomlkit.dumps(tree).encode("utf-8", "replace")


def _change(tree: dict[str, Any], random: Random) -> None:
    holder, key = random.choice(list(_places(tree)))
    what = random.randrange(6)
    if what == 0:
        del holder[key]
    elif what == 1 and isinstance(holder, dict):
        holder[
            random.choice(("define", "name", "format", "value", "at", "file", "x", "", "é", "a b", "<i>", "k@2"))
        ] = copy.deepcopy(random.choice(OTHERS))
    elif what == 2 and isinstance(holder, dict):
        holder[str(key)[:-1] + random.choice(("", "s", "e"))] = holder.pop(key)
    else:
        holder[key] = copy.deepcopy(random.choice(OTHERS))


def _places(tree: Any) -> Any:
    """Every place in a tree: what holds it, and its key or number."""
    for key, value in list(tree.items() if isinstance(tree, dict) else enumerate(tree)):
        yield tree, key
        if isinstance(value, (dict, list)) and value:
            yield from _places(value)
    if not tree:
        tree["x"] = 1
        yield tree, "x"
