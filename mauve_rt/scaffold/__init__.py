"""Packages of users: what `mauve new` writes, and where `mauve build` and `mauve run` find and put it."""
