"""What is written where in a bag: records, messages, MCAP."""
