"""ament_python: what colcon installs."""

from pathlib import Path

from setuptools import setup

NAME = "ruedo_ros"

setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        *(
            (f"share/{NAME}/{folder}", sorted(map(str, Path(folder).iterdir())))
            for folder in ("config", "launch", "rviz")
        ),
    ],
    install_requires=["setuptools"],
    entry_points={"console_scripts": ["go_to = ruedo_ros.go_to:main"]},
    zip_safe=False,
    maintainer="The Ruedo authors",
    maintainer_email="maintainers@ruedo.invalid",
    description="Starts Ruedo from launch files, and judges ROS 2 nodes by its referee.",
    license="BSD-3-Clause",
    tests_require=["pytest"],
)
