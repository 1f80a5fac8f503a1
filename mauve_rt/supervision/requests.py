"""What a supervisor waits for of its executor."""

ANSWER_TIMEOUT_S = 5.0
