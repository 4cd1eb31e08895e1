"""Settings of exports. All were chosen: nobody derived them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ExportSettings:
    """Source code and tables of a muscle for other programs."""

    width: int = 100  # characters: an expression longer than this is given a name; chosen
    window: int = 8  # samples of a signal that show whether an instrument looks back; chosen
    rows: int = 1_000_000  # of a table at most; chosen


EXPORT = ExportSettings()
