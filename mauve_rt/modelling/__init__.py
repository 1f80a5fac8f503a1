"""The model of a package: the modelling language of the paper as a file, and the code that is made of it.

Needs no native library and no plug-in: a build generates code before either exists.
"""
