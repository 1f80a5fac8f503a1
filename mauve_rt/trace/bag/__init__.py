"""Bags as files: written, checked, repaired."""
