"""How parts are written in Python: shells, cores, fsms, resources, ports, messages."""
