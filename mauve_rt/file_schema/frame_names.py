"""Names of frames of reference, as files declare them."""

from mauve_rt.file_schema.kinds import Text

_FORM = "no spaces, no slash at the begin, at most 255 characters"
FRAME = Text(r"[^\s/$()][^\s$()]{0,254}", f"a frame such as map or robot_1/base: {_FORM}")
"""As tf2 takes it."""
_CHARACTER = r"[^\s$()]|\$\((?:name|namespace)\)"
FRAME_OF_ROBOT = Text(rf"(?!/)(?:{_CHARACTER}){{1,255}}", f"a frame such as map or $(name)/base: {_FORM}")
"""The same with places of `mauve_rt.model.substitution` in it."""
