"""What evidence is gathered with: each number, and where it comes from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class EvidenceSettings:
    """Bets on the signs of scores, and how much evidence is enough."""

    stakes: tuple[float, ...] = (0.5, 1.0, 2.0, 4.0, 8.0)  # over the standard deviation of a session's score; chosen
    # Evidence that excludes a model wherever one stops, at a level of 1 %. Ville's inequality asks for 100 where no
    # error is common to sessions. One standard normal error b that is common to all can lift the evidence by exp(b^2/2)
    # at most, and the chance that this ever leads beyond x is 2 c/(x sqrt(2 pi)) + P(|b| > c), c = sqrt(2 ln x):
    # 0.0097 at 300.
    enough: float = 300.0


EVIDENCE = EvidenceSettings()
