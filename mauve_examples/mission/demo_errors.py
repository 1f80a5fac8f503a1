"""Why a demo does not run. str() of each is one line that says what to do."""


class BadInputError(Exception):
    """What the user asked for cannot be done; nothing was started. Exit status 2."""


class MissionError(Exception):
    """A mission that could not be started or went on no longer. Exit status 1."""
