"""How much to measure."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Amounts per round; every row has `rounds` rounds."""

    mode: str
    rounds: int
    wakeup_s: float
    swaps: int
    reloads: int
    stops: int
    busy_stops: int
    deployments: int
    reactions: int
    restarts: int
    inversions: int
    scale_s: float
    transactions: int
    soak: int
    service_calls: int
    topics_s: float
    recording_s: float
    kills: int
    read_records: tuple[int, ...]
    proofs: int
    proof_s: float
    priority: int = 80
    cpu: int = 0


QUICK = Settings(
    mode="quick",
    rounds=10,
    wakeup_s=1.0,
    swaps=100,
    reloads=10,
    stops=30,
    busy_stops=10,
    deployments=8,
    reactions=100,
    restarts=100,
    inversions=2,
    scale_s=0.3,
    transactions=100,
    soak=500,
    service_calls=50,
    topics_s=1.0,
    recording_s=2.0,
    kills=50,
    read_records=(1_000_000,),
    proofs=4,
    proof_s=10.0,
)
FULL = Settings(
    mode="full",
    rounds=20,
    wakeup_s=3.0,
    swaps=500,
    reloads=50,
    stops=100,
    busy_stops=40,
    deployments=30,
    reactions=500,
    restarts=50,
    inversions=10,
    scale_s=1.0,
    transactions=300,
    soak=10_000,
    service_calls=100,
    topics_s=3.0,
    recording_s=6.0,
    kills=50,
    read_records=(1_000_000, 10_000_000),
    proofs=20,
    proof_s=60.0,
)
