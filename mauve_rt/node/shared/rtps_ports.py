"""The UDP ports by which RTPS participants of one machine discover each other."""

_FIRST_PORT, _DOMAIN_PORTS = 7410, 250  # of discovery by unicast


def discovery_ports(domain: int, participants: int) -> range:
    """The ports of so many participants of a domain, by their numbers; the next port is that of its data."""
    first = _FIRST_PORT + _DOMAIN_PORTS * domain
    return range(first, first + 2 * participants, 2)
