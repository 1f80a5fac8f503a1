"""Which network interfaces count as usable; what is done about new ones is tested in ros/links."""

from mauve_rt.node.shared.network_interfaces import usable_addresses


def test_the_loopback_is_one() -> None:
    assert "lo 127.0.0.1" in usable_addresses()
