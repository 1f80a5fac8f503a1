"""Whether each text of a drawing can be read: large enough, within the drawing, on no other text."""

import re
from itertools import combinations
from xml.etree import ElementTree as ET

WIDEST_PX, SMALLEST_PX, EM = 1400, 10, 0.62


class Box:
    """The place of a text, where a character is 0.62 em wide."""

    def __init__(self, text: ET.Element, dx: float, dy: float) -> None:
        size = float(text.get("font-size", "0"))
        self.text, self.size = "".join(text.itertext()), size
        wide = EM * size * len(self.text)
        left = float(text.get("x", "nan")) + dx
        self.left = left - wide / 2 if text.get("text-anchor") == "middle" else left
        self.right = self.left + wide
        self.bottom = float(text.get("y", "nan")) + dy
        self.top = self.bottom - 0.8 * size

    def meets(self, other: "Box") -> bool:
        return (
            self.left < other.right
            and other.left < self.right
            and self.top < other.bottom
            and other.top < self.bottom
        )


def checked_texts(svg: str) -> list[str]:
    """The texts of a drawing that is narrow, and in which each text can be read."""
    root = ET.fromstring(svg)  # noqa: S314 - our own
    left, top, width, height = map(float, root.get("viewBox", "").split())
    assert width <= WIDEST_PX
    assert float(root.get("width", "nan")) == width, "one unit is one pixel"
    found = re.search(r"translate\(([-\d.]+) ([-\d.]+)\)", svg)
    assert found is not None
    boxes = [
        Box(one, float(found[1]), float(found[2])) for one in root.iter("{http://www.w3.org/2000/svg}text")
    ]
    assert boxes
    for box in boxes:
        assert box.size >= SMALLEST_PX
        assert left <= box.left < box.right <= left + width, box.text
        assert top <= box.top < box.bottom <= top + height, box.text
    assert not [(one.text, other.text) for one, other in combinations(boxes, 2) if one.meets(other)]
    return [box.text for box in boxes]
