"""Two runs compared: `mauve report A B --compare`.

`noise` judges whether a difference is larger than chance; `timing`, `values` and `events` measure both runs.
`compared` puts these together. `words` and `tables` have the texts that the terminal (mauve_rt.cli.compare)
and `page` show.
"""
