"""Messages out of bytes. The decoders that lcm-gen makes take what is there for texts and bytes,
however many a length says.
"""

from __future__ import annotations

import io
from typing import Any


class _Whole(io.BytesIO):
    def read(self, size: int | None = -1, /) -> bytes:
        came = super().read(size)
        if len(came) != size:
            raise ValueError(f"a length of {size} with {len(came)} bytes left")
        return came


def decode(message_type: Any, data: bytes) -> Any:
    """A message of a class that lcm-gen made. Raises when the bytes are not one, the whole one and
    nothing else.
    """
    whole = _Whole(data)
    message = message_type.decode(whole)
    if whole.tell() != len(data):
        raise ValueError(f"{len(data) - whole.tell()} bytes too many")
    return message
