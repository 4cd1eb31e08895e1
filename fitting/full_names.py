"""Full names of unknowns: 'tip.k', 'muscle.radius'; with '@' and a data set where each set has a value of its own."""

from collections.abc import Container

OF = "@"


def of_set(name: str, dataset: str) -> str:
    """The name of a data set's own value: 'tip.k@second set'."""
    return f"{name}{OF}{dataset}"


def common(name: str) -> str:
    """The name whatever the data set: 'tip.k' of 'tip.k' and of 'tip.k@second set'."""
    return name.split(OF)[0]


def set_of(name: str) -> str:
    """The data set whose own value a name is of: 'second set' of 'tip.k@second set'; empty where all share it."""
    return name.partition(OF)[2]


def listed(name: str, names: Container[str]) -> bool:
    """Whether names, each for one data set or for all, hold this one."""
    return name in names or common(name) in names


def owner_of(name: str) -> str:
    """What a name belongs to, an effect or the muscle: 'tip' of 'tip.k' and of 'tip.k@second set'."""
    return common(name).rsplit(".", 1)[0]
