"""Drawings of architectures and fsms, laid out by Graphviz. Knows neither ROS nor the native library.

`drawing` is the one description of a drawing. `components` and `fsms` make it of descriptions that executors,
bags and files have alike; `dot`, `mermaid`, `svg` and `page` write it. `look` has the colours.
"""
