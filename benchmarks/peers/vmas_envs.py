"""VMAS's environments: a disc whose velocity is imposed, with its lidar, in steps of 0.1 s, all
environments in torch's tensors.
"""

import math

import environments as common
import rooms as bench
import torch
import vmas
from vmas.simulator.core import Agent, Box, Landmark, Sphere, World
from vmas.simulator.scenario import BaseScenario
from vmas.simulator.sensors import Lidar


class Rooms(BaseScenario):
    def make_world(self, batch_dim, device, **options):
        self.rooms: bench.Rooms = options["rooms"]
        world = World(batch_dim, device, dt=common.DECISION_S, drag=0.0)
        lidar = Lidar(
            world,
            angle_start=-math.pi / 2,
            angle_end=math.pi / 2,
            n_rays=options["beams"],
            max_range=bench.LRF_RANGE_M,
        )
        world.add_agent(Agent("robot", shape=Sphere(0.25), sensors=[lidar], rotatable=True))
        for i, wall in enumerate(self.rooms.walls):
            shape = Box(length=wall.size[0], width=wall.size[1])
            world.add_landmark(Landmark(f"wall{i}", shape=shape, collide=True))
        return world

    def reset_world_at(self, env_index=None):
        start = self.rooms.starts[0]
        robot = self.world.agents[0]
        robot.set_pos(torch.tensor([start.x, start.y]), batch_index=env_index)
        robot.set_rot(torch.tensor([start.yaw]), batch_index=env_index)
        for landmark, wall in zip(self.world.landmarks, self.rooms.walls):
            landmark.set_pos(torch.tensor(wall.center[:2]), batch_index=env_index)

    def observation(self, agent):
        return torch.cat([agent.state.pos, agent.sensors[0].measure()], dim=-1)

    def reward(self, agent):
        return torch.zeros(self.world.batch_dim)


def main() -> None:
    given = common.options("VMAS")
    rooms = bench.load(given.world)
    environments = vmas.make_env(
        Rooms(), num_envs=given.envs, device="cpu", rooms=rooms, beams=given.beams
    )
    environments.reset()
    robot = environments.agents[0]
    still = [torch.zeros(given.envs, environments.get_agent_action_size(robot))]

    def step() -> int:
        heading = robot.state.rot[:, 0]
        velocity = torch.stack([torch.cos(heading), torch.sin(heading)], dim=1) * bench.SPEED_M_S
        robot.set_vel(velocity, batch_index=None)
        robot.state.ang_vel = torch.full((given.envs, 1), bench.TURN_RATE_RAD_S)
        environments.step(still)
        return given.envs

    with torch.no_grad():
        rate = common.rate(step, given.seconds)
    common.show("VMAS", given.envs, given.beams, rate)


if __name__ == "__main__":
    main()
