"""The one error class of the analysis package."""


class AnalysisError(Exception):
    """Parameters that cannot be analysed. `str()` is one line: where, what, expected, found, remedy."""

    def __init__(self, where: str, what: str, *, expected: str, found: str, remedy: str) -> None:
        super().__init__(f"{where}: {what}: expected {expected}, found {found}. {remedy}.")
        self.where = where
        self.expected = expected
        self.found = found
        self.remedy = remedy
