"""YAML that reads back the same, by YAML 1.2 and by 1.1."""

from typing import Any

import yaml

from mauve_rt.yaml.scalars import may_be_number, plain_value


class _Dumper(yaml.SafeDumper):
    """Quotes what is text here and no text in YAML 1.2; PyYAML does so for what is none in 1.1."""

    def ignore_aliases(self, _data: Any) -> bool:
        """Write everything out: a reader should not have to look things up."""
        return True


def _text(dumper: yaml.SafeDumper, text: str) -> Any:
    is_clear = isinstance(plain_value(text), str) and not may_be_number(text)  # readers differ on `-_1`
    style = None if is_clear else '"'
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Dumper.add_representer(str, _text)


def write_yaml(value: Any) -> str:
    """YAML text of plain values, in the order they have; what holds no more collections in one line."""
    return str(
        yaml.dump(
            value,
            Dumper=_Dumper,
            sort_keys=False,
            allow_unicode=True,
            default_flow_style=None,
            width=4096,
        )
    )
