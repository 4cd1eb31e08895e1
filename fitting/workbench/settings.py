"""Settings of the workbench. All were chosen: nobody derived them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class WorkbenchSettings:
    """The page and its server."""

    port: int = 8642  # of the server; chosen
    next_ports: int = 20  # that are tried where it is taken; chosen
    places: int = 201  # of a slider; chosen
    around: float = 10.0  # standard errors to either side of a slider, if that is more than the value itself; chosen
    columns: int = 80  # of the terminal: a sentence may be longer; chosen
    offered: int = 8  # effects that are offered to be added; chosen


WORKBENCH = WorkbenchSettings()
