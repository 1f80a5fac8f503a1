"""How much to measure."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Amounts per round; every row has `rounds` rounds."""

    mode: str
    rounds: int
    wakeup_s: float
    swaps: int
    stops: int
    deployments: int
    restarts: int
    priority: int = 80
    cpu: int = 0


QUICK = Settings(mode="quick", rounds=10, wakeup_s=2.0, swaps=100, stops=60, deployments=15, restarts=20)
FULL = Settings(mode="full", rounds=20, wakeup_s=5.0, swaps=500, stops=300, deployments=50, restarts=50)
