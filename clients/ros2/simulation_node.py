#!/usr/bin/env python3
"""The services of simulation_interfaces 1.x on any ROS 2 middleware: a node of rclpy over Ruedo's
Python client.

    python3 simulation_node.py

beside `ruedo run WORLD --ros2`, with LCM's address in LCM_DEFAULT_URL where it is not the default.
It needs rclpy and simulation_interfaces of a ROS 2 installation, and the package `ruedo`. Nobody
has run it with a real ROS 2 yet.
"""

from __future__ import annotations

import re

import rclpy
import ruedo
from rclpy.node import Node
from simulation_interfaces.msg import Result, SimulationState
from simulation_interfaces.srv import (
    DeleteEntity,
    GetEntities,
    GetEntityState,
    GetSimulationState,
    ResetSimulation,
    SetEntityState,
    SetSimulationState,
    SpawnEntity,
    StepSimulation,
)


class SimulationNode(Node):
    def __init__(self, sim: ruedo.Simulation) -> None:
        super().__init__("ruedo_simulation")
        self.sim = sim
        for kind, name, handler in (
            (GetSimulationState, "get_simulation_state", self.get_state),
            (SetSimulationState, "set_simulation_state", self.set_state),
            (StepSimulation, "step_simulation", self.step),
            (ResetSimulation, "reset_simulation", self.reset),
            (SpawnEntity, "spawn_entity", self.spawn),
            (DeleteEntity, "delete_entity", self.delete),
            (GetEntities, "get_entities", self.entities),
            (GetEntityState, "get_entity_state", self.entity_state),
            (SetEntityState, "set_entity_state", self.set_entity_state),
        ):
            self.create_service(kind, name, self.answered(handler))

    def answered(self, handler):
        """The handler with the Result of what it did."""

        def answer(request, response):
            try:
                handler(request, response)
                response.result.result = Result.RESULT_OK
            except ruedo.UnknownName as error:
                response.result = Result(result=Result.RESULT_NOT_FOUND, error_message=str(error))
            except ruedo.RuedoError as error:
                response.result = Result(
                    result=Result.RESULT_OPERATION_FAILED, error_message=str(error)
                )
            return response

        return answer

    def get_state(self, _request, response) -> None:
        response.state.state = (
            SimulationState.STATE_PAUSED if self.sim.paused else SimulationState.STATE_PLAYING
        )

    def set_state(self, request, _response) -> None:
        wanted = request.state.state
        if wanted == SimulationState.STATE_PLAYING:
            self.sim.resume()
        elif wanted == SimulationState.STATE_QUITTING:
            self.sim.quit()
        else:
            self.sim.pause()
            if wanted == SimulationState.STATE_STOPPED:
                self.sim.reset()

    def step(self, request, _response) -> None:
        self.sim.step(request.steps)

    def reset(self, request, _response) -> None:
        whole = {
            ResetSimulation.Request.SCOPE_TIME: "time",
            ResetSimulation.Request.SCOPE_STATE: "poses",
        }
        self.sim.reset(whole.get(request.scope, "all"))

    def spawn(self, request, response) -> None:
        pose = request.initial_pose.pose
        q = pose.orientation
        response.entity_name = self.sim.spawn(
            request.uri.removeprefix("file://"),
            pose.position.x,
            pose.position.y,
            name=request.name,
            text=request.resource_string,
            z=pose.position.z,
        )
        if (q.x, q.y, q.z) != (0.0, 0.0, 0.0):
            self.sim.set_pose(
                response.entity_name,
                pose.position.x,
                pose.position.y,
                z=pose.position.z,
                orientation=(q.w, q.x, q.y, q.z),
            )

    def delete(self, request, _response) -> None:
        self.sim.remove(request.entity)

    def entities(self, request, response) -> None:
        names = {body.name.split("/")[0] for body in self.sim.bodies}
        response.entities = sorted(
            name for name in names if re.search(request.filters.filter, name)
        )

    def entity_state(self, request, response) -> None:
        state = self.sim.state(request.entity)
        response.state.header.frame_id = "world"
        pose, twist = response.state.pose, response.state.twist
        pose.position.x, pose.position.y, pose.position.z = state.position
        pose.orientation.w, pose.orientation.x, pose.orientation.y, pose.orientation.z = (
            state.orientation
        )
        twist.linear.x, twist.linear.y, twist.linear.z = state.linear
        twist.angular.x, twist.angular.y, twist.angular.z = state.angular

    def set_entity_state(self, request, _response) -> None:
        p, q, twist = (
            request.state.pose.position,
            request.state.pose.orientation,
            request.state.twist,
        )
        self.sim.set_pose(request.entity, p.x, p.y, z=p.z, orientation=(q.w, q.x, q.y, q.z))
        linear, angular = twist.linear, twist.angular
        if any((linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)):
            self.sim.set_twist(
                request.entity, (linear.x, linear.y, linear.z), (angular.x, angular.y, angular.z)
            )


def main() -> None:
    rclpy.init()
    with ruedo.connect() as sim:
        node = SimulationNode(sim)
        try:
            rclpy.spin(node)
        except KeyboardInterrupt:
            pass
        finally:
            node.destroy_node()


if __name__ == "__main__":
    main()
