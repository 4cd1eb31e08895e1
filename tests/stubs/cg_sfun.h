/* What Simulink appends to an S-function that is not a MEX file: nothing, for the tests call the functions themselves. */
