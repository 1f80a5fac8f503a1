"""The `mauve` command: an executor's services, architecture files and plug-ins, from a terminal."""
