# The compiled module: engine/engine_module.cpp says what it has, ruedo.Engine what is for users.
from typing import Any

def __getattr__(name: str) -> Any: ...
