"""The node `supervisor`: watches and asks for changes by rules."""
