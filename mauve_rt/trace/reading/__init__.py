"""From a bag to records, frames, reconfigurations, statistics."""
