"""Where the noise of one reading is known from, as pages and JSON say it."""

from fitting.recordings.records import NoiseSource

NOISE_TEXT = {
    NoiseSource.STATED: "as stated",
    NoiseSource.STATED_OF_ALL: "as stated of force, pressure and position",
    NoiseSource.NEIGHBOURS: "from neighbouring readings",
    NoiseSource.MOTION: "that of a motion, read as force",
    NoiseSource.ASSUMED: "presumed",
}
