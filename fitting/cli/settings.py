"""Settings of commands that do much at once. All were chosen: nobody derived them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class WorkSettings:
    """Work that is handed out to processes and computers."""

    ahead: int = 2  # pieces in flight for each thread of the workers; chosen
    patience: int = 20  # failures of one piece before it is given up; chosen
    maps: int = 30_000  # of a process's memory; XLA makes some for each program, Linux allows 65,530; chosen


WORK = WorkSettings()
