"""A fitted muscle as a block of Simulink: a Level-2 S-function in C around the header of C99."""

from string import Template

from fitting.exporting.c_header import c_header
from fitting.exporting.laws import NOTHING, Told
from mckibben_jax.model import Model


def simulink_files(whole: Model, source: str, name: str, told: Told = NOTHING) -> dict[str, str]:
    """The texts of the folder's files, by their names; the block is called by `name`, a word of C."""
    block = f"{name}_block"
    return {"muscle.h": c_header(whole, source, "muscle", told), f"{block}.c": _BLOCK.substitute(block=block)}


_BLOCK = Template("""/* A McKibben muscle as a block of Simulink: a Level-2 S-function in C.
 * The muscle itself is in muscle.h.
 *
 * In MATLAB, in this folder:   mex $block.c
 * In a model: the block "S-Function", its name $block, its one parameter the sample time in s, for example 1e-3.
 *
 * Inputs:  1 gauge pressure, Pa;  2 displacement, how much shorter than at rest, m.
 * Outputs: 1 force, N, positive when the muscle pulls;  2 pull, the force without dry friction, N;
 *          3 friction, the most that dry friction can resist, N;
 *          4 stiffness, how much more it pulls per metre that it is longer, in slow motion, N/m.
 *
 * At the first sample the muscle has stood where its inputs are for long. From then on every sample is one step. What
 * the muscle remembers is in the work vector of the block, so that a model may have any number of muscles.
 */
#define S_FUNCTION_NAME $block
#define S_FUNCTION_LEVEL 2

#include "simstruc.h"

#include "muscle.h"

enum { PRESSURE, DISPLACEMENT, INPUTS };
enum { FORCE, PULL, FRICTION, STIFFNESS, OUTPUTS };

typedef struct {
    real_T has_begun; /* 0 until the first sample has passed */
    muscle_state state;
} Memory;

#define REALS ((sizeof(Memory) + sizeof(real_T) - 1) / sizeof(real_T))

static real_T input(SimStruct *S, int port) { return *ssGetInputPortRealSignalPtrs(S, port)[0]; }
static Memory *memory(SimStruct *S) { return (Memory *)ssGetRWork(S); }
static real_T sample_time(SimStruct *S) { return mxGetScalar(ssGetSFcnParam(S, 0)); }

static void mdlInitializeSizes(SimStruct *S) {
    int port;
    ssSetNumSFcnParams(S, 1);
    if (ssGetNumSFcnParams(S) != ssGetSFcnParamsCount(S)) return; /* Simulink says that the sample time lacks */
    ssSetSFcnParamTunable(S, 0, 0);
    if (!(sample_time(S) > 0)) {
        ssSetErrorStatus(S, "$block: the sample time has to be above 0, in seconds");
        return;
    }
    if (!ssSetNumInputPorts(S, INPUTS) || !ssSetNumOutputPorts(S, OUTPUTS)) return;
    for (port = 0; port < INPUTS; ++port) {
        ssSetInputPortWidth(S, port, 1);
        ssSetInputPortDirectFeedThrough(S, port, 1);
    }
    for (port = 0; port < OUTPUTS; ++port) ssSetOutputPortWidth(S, port, 1);
    ssSetNumSampleTimes(S, 1);
    ssSetNumRWork(S, REALS);
}

static void mdlInitializeSampleTimes(SimStruct *S) {
    ssSetSampleTime(S, 0, sample_time(S));
    ssSetOffsetTime(S, 0, 0.0);
}

#define MDL_INITIALIZE_CONDITIONS
static void mdlInitializeConditions(SimStruct *S) { memory(S)->has_begun = 0; }

/* Simulink may ask for the outputs more than once: the memory changes in mdlUpdate only. */
static void mdlOutputs(SimStruct *S, int_T tid) {
    const real_T pressure = input(S, PRESSURE), displacement = input(S, DISPLACEMENT);
    muscle_real friction = 0, pull, direction = 0, contraction = (muscle_real)displacement / MUSCLE_LENGTH;
    (void)tid;
    if (memory(S)->has_begun) {
        muscle_state next = memory(S)->state;
        pull = muscle_step_parts(&next, pressure, displacement, sample_time(S), &friction);
        direction = next.direction;
    } else {
        pull = muscle_force(contraction, pressure, 0, 0);
    }
    *ssGetOutputPortRealSignal(S, FORCE) = pull - direction * friction;
    *ssGetOutputPortRealSignal(S, PULL) = pull;
    *ssGetOutputPortRealSignal(S, FRICTION) = friction;
    *ssGetOutputPortRealSignal(S, STIFFNESS) = muscle_stiffness(contraction, pressure, direction);
}

#define MDL_UPDATE
static void mdlUpdate(SimStruct *S, int_T tid) {
    Memory *kept = memory(S);
    (void)tid;
    if (kept->has_begun) {
        muscle_step(&kept->state, input(S, PRESSURE), input(S, DISPLACEMENT), sample_time(S));
    } else {
        kept->state = muscle_start(input(S, PRESSURE), input(S, DISPLACEMENT));
        kept->has_begun = 1;
    }
}

static void mdlTerminate(SimStruct *S) { (void)S; }

#ifdef MATLAB_MEX_FILE
#include "simulink.c"
#else
#include "cg_sfun.h"
#endif
""")
