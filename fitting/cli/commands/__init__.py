"""One file per command. A file here that defines `command` is a command; its name is the file's."""
