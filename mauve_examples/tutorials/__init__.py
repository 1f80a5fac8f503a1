"""First components: a metronome in C++, another core for it in C++, and one in Python."""
