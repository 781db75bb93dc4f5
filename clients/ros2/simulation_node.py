#!/usr/bin/env python3
"""The services of simulation_interfaces 1.x on any ROS 2 middleware: a node of rclpy over Ruedo's Python client.

    python3 simulation_node.py            # beside `ruedo run WORLD --ros2`, with LCM's address in LCM_DEFAULT_URL where it is not the default

It needs rclpy and simulation_interfaces of a ROS 2 installation, and the package `ruedo`. Nobody has run it with a real ROS 2 yet.
"""

from __future__ import annotations

import re

import rclpy
import ruedo
from rclpy.node import Node
from simulation_interfaces.msg import Result, SimulationState
from simulation_interfaces.srv import (DeleteEntity, GetEntities, GetEntityState, GetSimulationState, ResetSimulation, SetEntityState,
                                       SetSimulationState, SpawnEntity, StepSimulation)


class SimulationNode(Node):
    def __init__(self, sim: ruedo.Simulation) -> None:
        super().__init__("ruedo_simulation")
        self.sim = sim
        for kind, name, handler in (
            (GetSimulationState, "get_simulation_state", self.get_state), (SetSimulationState, "set_simulation_state", self.set_state),
            (StepSimulation, "step_simulation", self.step), (ResetSimulation, "reset_simulation", self.reset),
            (SpawnEntity, "spawn_entity", self.spawn), (DeleteEntity, "delete_entity", self.delete), (GetEntities, "get_entities", self.entities),
            (GetEntityState, "get_entity_state", self.entity_state), (SetEntityState, "set_entity_state", self.set_entity_state),
        ):
            self.create_service(kind, name, self.answered(handler))
