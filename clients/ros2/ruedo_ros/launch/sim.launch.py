"""A simulation, with its robot in RViz.

ros2 launch ruedo_ros sim.launch.py world:=arena robot:=p3at
ros2 launch ruedo_ros sim.launch.py world:=empty robot:=turtle rviz:=true bag:=drive
"""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch_ros.actions import Node
from ruedo_ros import Simulation
from ruedo_ros.actions import ruedo

RVIZ = Path(__file__).resolve().parents[1] / "rviz"


def robots_of(world: str, program: str) -> list[str]:
    """Of the world's file; empty where it cannot be read, of which the simulation will say why."""
    told = subprocess.run([program, "info", "--json", world], capture_output=True, text=True)
    return [robot["name"] for robot in json.loads(told.stdout)["robots"]] if told.stdout else []


def simulation(context: LaunchContext) -> list[Simulation]:
    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    program = perform_substitutions(context, normalize_to_list_of_substitutions(ruedo()))
    is_there = robots_of(value("world"), program)
    return [
        Simulation(
            value("world"),
            spawn=[] if is_there else [f"{value('robot')}@0,0"],
            bag=value("bag") or None,
            lcm=value("lcm"),
            arguments=[*(["--view"] if value("view") == "true" else []), *value("options").split()],
            on_exit=Shutdown(reason="the simulation has ended"),
        )
    ]


def generate_launch_description() -> LaunchDescription:
    def argument(name: str, default: str, text: str) -> DeclareLaunchArgument:
        return DeclareLaunchArgument(name, default_value=default, description=text)

    return LaunchDescription(
        [
            argument("world", "arena", "a file, or the name of one of Ruedo's"),
            argument("robot", "p3at", "p3at or turtle: spawned if the world has none, and shown"),
            argument("rviz", "false", "show the robot in rviz2"),
            argument("view", "false", "serve the web console"),
            argument("bag", "", "a new folder for the run as a bag"),
            argument("lcm", "memq://", "where LCM's clients find the run"),
            argument("options", "", "more of `ruedo run`, separated by spaces"),
            OpaqueFunction(function=simulation),
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=["-d", [f"{RVIZ}/", LaunchConfiguration("robot"), ".rviz"]],
                parameters=[{"use_sim_time": True}],
                condition=IfCondition(LaunchConfiguration("rviz")),
            ),
        ]
    )
