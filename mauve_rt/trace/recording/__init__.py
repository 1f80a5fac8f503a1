"""From a host's rings into a bag. Does without numpy."""
