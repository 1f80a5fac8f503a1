"""What the nodes have in common: process, settings, arguments, threads."""
