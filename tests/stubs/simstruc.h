/* What an S-function asks of Simulink, as far as ours does: written for the tests from the public documentation of
 * S-functions, for no MATLAB is at hand there. */
#ifndef STUB_SIMSTRUC_H
#define STUB_SIMSTRUC_H

#include <stddef.h>

typedef double real_T;
typedef int int_T;
typedef const real_T *const *InputRealPtrsType;
typedef struct { double value; } mxArray;

typedef struct {
    int expected_parameters, inputs, outputs, sample_times, works, widths;
    int feeds_through[8], is_tunable;
    double sample_time, offset;
    const char *error;
    mxArray parameter;
    const real_T *input[8];
    real_T output[8];
    real_T work[256];
} SimStruct;

#define ssSetNumSFcnParams(S, n) ((S)->expected_parameters = (n))
#define ssGetNumSFcnParams(S) ((S)->expected_parameters)
#define ssGetSFcnParamsCount(S) 1
#define ssSetSFcnParamTunable(S, i, yes) ((S)->is_tunable = (yes))
#define ssGetSFcnParam(S, i) (&(S)->parameter)
#define mxGetScalar(array) ((array)->value)
#define ssSetErrorStatus(S, text) ((S)->error = (text))
#define ssSetNumInputPorts(S, n) (((S)->inputs = (n)), 1)
#define ssSetNumOutputPorts(S, n) (((S)->outputs = (n)), 1)
#define ssSetInputPortWidth(S, port, n) ((S)->widths += (n))
#define ssSetOutputPortWidth(S, port, n) ((S)->widths += (n))
#define ssSetInputPortDirectFeedThrough(S, port, yes) ((S)->feeds_through[port] = (yes))
#define ssSetNumSampleTimes(S, n) ((S)->sample_times = (n))
#define ssSetSampleTime(S, i, t) ((S)->sample_time = (t))
#define ssSetOffsetTime(S, i, t) ((S)->offset = (t))
#define ssSetNumRWork(S, n) ((S)->works = (int)(n))
#define ssGetRWork(S) ((S)->work)
#define ssGetInputPortRealSignalPtrs(S, port) ((InputRealPtrsType)&(S)->input[port])
#define ssGetOutputPortRealSignal(S, port) (&(S)->output[port])
#endif
