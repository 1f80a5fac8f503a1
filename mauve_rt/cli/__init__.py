"""The `mauve` command: an executor's services from a terminal, and a look at architecture files and plug-ins."""
