"""The exploration mission as a whole: robots, the radio between them, the demo that runs and judges it."""
