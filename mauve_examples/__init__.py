"""Examples of MAUVE RT: the exploration mission of the paper, with components in C++ and maps of its own."""
