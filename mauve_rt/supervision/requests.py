"""What a supervisor waits for of its executor."""

ANSWER_TIMEOUT_NS = 5_000_000_000
STATE_TIMEOUT_NS = 2_000_000_000  # from the answer on
