"""Changes the world, then drives 0.5 m ahead: edits.py WHAT."""

import sys

import ruedo

BOX = """<sdf version='1.9'><model name='{0}'><static>{1}</static><link name='link'><collision name='c'>
<geometry><box><size>0.2 2 0.5</size></box></geometry></collision></link></model></sdf>"""


def spawn_in_the_way(sim):
    sim.spawn(text=BOX.format("wall", "true"), name="wall", x=0.6, y=0.0)


def spawn_aside(sim):
    sim.spawn(text=BOX.format("wall", "true"), name="wall", x=-3.0, y=0.0)


def spawn_misspelt(sim):
    text = BOX.format("wall", "true").replace("collision", "collison")
    sim.spawn(text=text, name="wall", x=-3.0, y=0.0)


def keep_the_box(sim):
    pass


def put_ahead(sim):
    sim.set_pose("p3at", x=0.5, y=0.0)


def kidnap(sim):
    sim.robot("p3at").inject("kidnapped", place=(0.5, 0.0, 0.0))


def reset(sim):
    sim.reset()


def respawn(sim):
    sim.remove("p3at")
    sim.spawn("p3at", name="p3at", x=0.5, y=0.0)


def respawn_before_the_box(sim):
    sim.remove("p3at")
    sim.spawn("p3at", name="p3at", x=1.2, y=0.0)


def drive_where_the_box_was(sim):
    sim.remove("box")
    sim.robot("p3at").advance(1.5).wait()


def drive_into_the_box(sim):
    sim.robot("p3at").advance(1.5).wait()


with ruedo.connect() as sim:
    globals()[sys.argv[1]](sim)
    sim.robot("p3at").advance(0.5).wait()
