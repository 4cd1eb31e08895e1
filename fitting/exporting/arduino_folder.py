"""A fitted muscle as a sketch for Arduino: it reads the pressure and prints the force; around the header of C99."""

from string import Template

from fitting.exporting.c_header import c_header
from fitting.exporting.laws import NOTHING, Told
from mckibben_jax.model import Model


def arduino_files(whole: Model, source: str, name: str, told: Told = NOTHING) -> dict[str, str]:
    """The texts of the folder's files, by their names; a sketch has to have the `name` of its folder."""
    return {"muscle.h": c_header(whole, source, "muscle", told), f"{name}.ino": _SKETCH.substitute(name=name)}


_SKETCH = Template("""/* A McKibben muscle on a microcontroller: loop() reads pressure and position and
 * prints the force.
 * The muscle is in muscle.h.
 *
 * Open this folder in the Arduino IDE. The numbers below are those of a usual sensor: write yours. The muscle computes
 * in float. It needs no memory beyond muscle_state, and keeps nothing between calls but what is in it.
 */
#define MUSCLE_FLOAT
#include "muscle.h"

/* yours: the sensors */
const int PRESSURE_PIN = A0;
const float PRESSURE_ZERO = 102.4f;       /* counts at gauge pressure 0: 0.5 V of 5 V on 10 bits */
const float PASCAL_PER_COUNT = 1220.7f;   /* 0 to 10 bar between 0.5 V and 4.5 V */
const int POSITION_PIN = A1;
const float POSITION_ZERO = 0.0f;         /* counts at the muscle's length at rest */
const float METRES_PER_COUNT = 0.0001f;   /* positive when the muscle gets shorter */
/* Friction turns round with the motion, so that a reading that jitters would make the force jump by twice the friction.
 * The muscle stands until the reading has moved by more than this: more than your sensor's noise and its last count. */
const float STILL = 0.0003f;              /* m */

const unsigned long STEP = 5000;          /* us between two steps of the muscle */
const int PRINT_EVERY = 20;               /* steps */

muscle_state state;
unsigned long before;                     /* us, when the last step was made */
int steps = 0;
float held = 0.0f;                        /* m, where the muscle is taken to be */

float pressure() { return (analogRead(PRESSURE_PIN) - PRESSURE_ZERO) * PASCAL_PER_COUNT; }       /* Pa */
float position() { return (analogRead(POSITION_PIN) - POSITION_ZERO) * METRES_PER_COUNT; }       /* m */

/* m: follows the position at a distance of STILL at most, as if there were play between them */
float displacement() {
    const float here = position();
    if (here - held > STILL) held = here - STILL;
    if (held - here > STILL) held = here + STILL;
    return held;
}

void setup() {
    Serial.begin(115200);
    Serial.print("force [N], on the way 99 of 100 are within +- ");
    Serial.println(MUSCLE_FORCE_ERROR, 1);
    held = position();
    state = muscle_start(pressure(), held);   /* it has stood here for long */
    before = micros();
}

void loop() {
    const unsigned long now = micros();
    if (now - before < STEP) return;                    /* right across the overflow of micros() too */
    const float force = muscle_step(&state, pressure(), displacement(), (now - before) * 1e-6f);
    before = now;
    if (++steps >= PRINT_EVERY) {
        steps = 0;
        Serial.println(force, 2);
    }
}
""")
