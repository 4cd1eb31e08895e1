"""The command line: arguments and options, the commands, and where their results go."""
