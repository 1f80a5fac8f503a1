"""Traces for other tools: CSV, Perfetto."""
