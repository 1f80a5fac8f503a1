"""Fig. 3, 5 and 6 of the paper, redrawn from traces of this project: `scripts/figures`."""
