"""Ruedo in launch files and in tests that launch nodes."""

from ruedo_ros.actions import Regression, Simulation

__all__ = ["Regression", "Simulation"]
