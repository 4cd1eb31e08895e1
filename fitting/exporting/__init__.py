"""A fitted muscle for other programs: numpy, C, Simulink, Arduino, MuJoCo, an FMU, or a table."""
