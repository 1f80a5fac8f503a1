"""What `mauve doctor` examines: whether this computer, this shell and this installation suit an executor.

`checks` has the table of checks; each is a function of a `Computer` that yields findings. `wakeup` measures.
"""
