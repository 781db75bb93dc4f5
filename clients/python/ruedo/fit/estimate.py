"""An estimated value, with its interval and where it comes from."""

from __future__ import annotations

import math
from dataclasses import dataclass

Z95 = 1.959964


@dataclass(frozen=True)
class Estimate:
    """value: None where the log does not determine it; why says so then. low, high: 95 %."""

    name: str
    value: float | None
    low: float = math.nan
    high: float = math.nan
    unit: str = ""
    why: str = ""  # how it was found, or what is missing

    def text(self) -> str:
        if self.value is None:
            return f"{self.name}: not determined: {self.why}"
        unit = f" {self.unit}" if self.unit else ""
        interval = f" ({self.low:.5g} to {self.high:.5g})" if math.isfinite(self.low) else ""
        return f"{self.name}: {self.value:.6g}{unit}{interval}"


def normal(name: str, value: float, std: float, unit: str = "", why: str = "") -> Estimate:
    return Estimate(name, value, value - Z95 * std, value + Z95 * std, unit, why)


def log_normal(name: str, value: float, relative: float, unit: str = "", why: str = "") -> Estimate:
    """An estimate of a positive value, from the standard deviation of its logarithm."""
    factor = math.exp(min(Z95 * relative, 50))
    return Estimate(name, value, value / factor, value * factor, unit, why)
