"""YAML as the project reads and writes it: limited, with places, without surprises."""
