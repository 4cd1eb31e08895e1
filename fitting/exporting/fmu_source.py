"""The C between the FMI 2.0 standard and the header of a muscle."""

FMU_SOURCE = r"""/* A McKibben muscle as an FMU: FMI 2.0, co-simulation. The muscle is in muscle.h. */
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "muscle.h"

enum { PRESSURE, DISPLACEMENT, WANTED_FORCE, INPUTS };
enum { FORCE = INPUTS, PULL, FRICTION, DIRECTION, STIFFNESS, NEXT_PRESSURE, FORCE_ERROR };

typedef struct {
    double inputs[INPUTS];
    muscle_state state;
    double pull, friction; /* N, of the last step */
    double step; /* s, the last one's */
    int stands; /* no step was made yet: it has stood where the inputs are for long */
} Muscle;

static void reset(Muscle *muscle) {
    memset(muscle, 0, sizeof *muscle);
    muscle->step = 1e-3;
    muscle->stands = 1;
}

static void stand(Muscle *muscle) {
    muscle->state = muscle_start(muscle->inputs[PRESSURE], muscle->inputs[DISPLACEMENT]);
    muscle->pull = muscle_force(muscle->state.contraction, muscle->state.pressure, 0, 0);
    muscle->friction = 0;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    Muscle *muscle;
    (void)name; (void)resources; (void)functions; (void)visible; (void)logging;
    if (type != fmi2CoSimulation || !guid || strcmp(guid, FMU_GUID)) return NULL;
    muscle = malloc(sizeof *muscle);
    if (muscle) reset(muscle);
    return muscle;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2Reset(fmi2Component c) { reset(c); return fmi2OK; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) {
    (void)c; (void)on; (void)n; (void)names;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean ends, fmi2Real stop) {
    (void)c; (void)tolerant; (void)tolerance; (void)start; (void)ends; (void)stop;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { stand(c); return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { stand(c); return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean final) {
    Muscle *muscle = c;
    (void)time; (void)final;
    if (!(step > 0)) return step == 0 ? fmi2OK : fmi2Error;
    muscle->pull = muscle_step_parts(&muscle->state, muscle->inputs[PRESSURE], muscle->inputs[DISPLACEMENT], step,
                                     &muscle->friction);
    muscle->step = step;
    muscle->stands = 0;
    return muscle->pull - muscle->pull == 0 ? fmi2OK : fmi2Error;
}

static double output(Muscle *muscle, fmi2ValueReference which) {
    const muscle_state *state = &muscle->state;
    if (muscle->stands) stand(muscle);
    switch (which) {
    case FORCE: return muscle->pull - state->direction * muscle->friction;
    case PULL: return muscle->pull;
    case FRICTION: return muscle->friction;
    case DIRECTION: return state->direction;
    case FORCE_ERROR: return MUSCLE_FORCE_ERROR;
    case STIFFNESS: return muscle_stiffness(state->contraction, state->pressure, state->direction);
    default: return muscle_pressure_for_step(state, muscle->inputs[WANTED_FORCE], muscle->inputs[DISPLACEMENT],
                                             muscle->step);
    }
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    Muscle *muscle = c;
    for (size_t i = 0; i < n; ++i) {
        if (vr[i] > FORCE_ERROR) return fmi2Error;
        value[i] = vr[i] < INPUTS ? muscle->inputs[vr[i]] : output(muscle, vr[i]);
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    for (size_t i = 0; i < n; ++i) {
        if (vr[i] >= INPUTS) return fmi2Error;
        ((Muscle *)c)->inputs[vr[i]] = value[i];
    }
    return fmi2OK;
}

/* There are no variables of other types. */
#define NONE(name, type) \
    fmi2Status name(fmi2Component c, const fmi2ValueReference vr[], size_t n, type value[]) { \
        (void)c; (void)vr; (void)value; \
        return n ? fmi2Error : fmi2OK; \
    }
NONE(fmi2GetInteger, fmi2Integer)
NONE(fmi2GetBoolean, fmi2Boolean)
NONE(fmi2GetString, fmi2String)
NONE(fmi2SetInteger, const fmi2Integer)
NONE(fmi2SetBoolean, const fmi2Boolean)
NONE(fmi2SetString, const fmi2String)

/* The state can be kept and set back: all of it is in one struct. */
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *kept) {
    if (!*kept) *kept = malloc(sizeof(Muscle));
    if (!*kept) return fmi2Error;
    memcpy(*kept, c, sizeof(Muscle));
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate kept) { memcpy(c, kept, sizeof(Muscle)); return fmi2OK; }
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *kept) {
    (void)c;
    free(*kept);
    *kept = NULL;
    return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate kept, size_t *size) {
    (void)c; (void)kept; (void)size;
    return fmi2Error;
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate kept, fmi2Byte bytes[], size_t size) {
    (void)c; (void)kept; (void)bytes; (void)size;
    return fmi2Error;
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *kept) {
    (void)c; (void)bytes; (void)size; (void)kept;
    return fmi2Error;
}

/* What modelDescription.xml says that it cannot do. */
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference of[], size_t n,
                                        const fmi2ValueReference by[], size_t m, const fmi2Real dv[], fmi2Real d[]) {
    (void)c; (void)of; (void)n; (void)by; (void)m; (void)dv; (void)d;
    return fmi2Error;
}
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    (void)c; (void)vr; (void)order; (void)value;
    return n ? fmi2Error : fmi2OK;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[]) {
    (void)c; (void)vr; (void)order; (void)value;
    return n ? fmi2Error : fmi2OK;
}
fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }

#define STATUS(name, type) \
    fmi2Status name(fmi2Component c, const fmi2StatusKind kind, type *value) { \
        (void)c; (void)kind; (void)value; \
        return fmi2Discard; \
    }
STATUS(fmi2GetStatus, fmi2Status)
STATUS(fmi2GetRealStatus, fmi2Real)
STATUS(fmi2GetIntegerStatus, fmi2Integer)
STATUS(fmi2GetBooleanStatus, fmi2Boolean)
STATUS(fmi2GetStringStatus, fmi2String)
"""
