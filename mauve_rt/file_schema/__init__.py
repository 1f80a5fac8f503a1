"""YAML files with a schema: what each key may be, and errors with their places. Needs no native library."""
