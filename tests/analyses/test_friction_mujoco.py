"""Friction beside MuJoCo: contacts of boxes and cylinders with friction, moved slowly.

Its contacts are soft and its friction creeps, so that some percent are left: of the force of a drawer that is pushed,
and of what friction does to a lever. Units are metres and newtons.
"""

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose

import jointplay as jp
from helpers.machines import drawer, lever

HEAD = """<mujoco><compiler angle="radian"/>
<option timestep="2e-4" cone="elliptic" impratio="100" gravity="0 0 0" integrator="implicitfast"/>
<default><geom friction="{mu} 0 0" solref="0.002 1" solimp="0.99 0.99 1e-5"/></default><worldbody>"""
#: a box between two plates, its hand and its load beside the middle
BOX = """<geom type="box" size="1 0.01 0.05" pos="0 0.02501 0"/><geom type="box" size="1 0.01 0.05" pos="0 -0.02501 0"/>
<body><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0" damping="50"/>
<joint type="hinge" axis="0 0 1" damping="0.05"/><geom type="box" size="0.04 0.015 0.01" mass="0.2"/>
<site name="hand" pos="0 {push} 0"/><site name="load" pos="0 {load} 0"/></body></worldbody>
<actuator><general site="hand" gear="1 0 0 0 0 0"/><general site="load" gear="1 0 0 0 0 0"/></actuator></mujoco>"""


def pushed(mu, push, load, *, time=2.0, speed=0.01):
    """The mean force of a hand that goes on slowly against 10 N, and which part of its way the drawer went."""
    model = mujoco.MjModel.from_xml_string(HEAD.format(mu=mu) + BOX.format(push=push, load=load))
    data, forces = mujoco.MjData(model), []
    steps = round(time / model.opt.timestep)
    for k in range(steps):
        behind = speed * k * model.opt.timestep - data.site_xpos[0, 0]
        data.ctrl[:] = [2e4 * behind + 200.0 * (speed - data.qvel[0]), -10.0]
        mujoco.mj_step(model, data)
        forces.append(data.ctrl[0])
    return np.mean(forces[steps * 3 // 5 :]), data.site_xpos[0, 0] / (speed * time)


@pytest.mark.parametrize(("mu", "push", "load"), [(0.05, 100, 0), (0.2, 100, 0), (0.2, 0, 100), (0.39, 0, 100)])
def test_drawer(mu, push, load):
    force, went = pushed(mu, 1e-3 * push, 1e-3 * load)
    result = jp.loaded(drawer(mu, push=push, load=load), approach="forward")
    assert went > 0.9
    assert_allclose(force, result.drive_torque[0, 0], rtol=0.025)


def test_drawer_that_jams():
    """Against ten times the load it goes nowhere."""
    assert jp.loaded(drawer(0.45, push=100, load=0), approach="forward").status[0] == "jammed"
    force, went = pushed(0.45, 0.1, 0.0)
    assert force > 100.0
    assert went < 0.02


def turned(mu, side, *, walls=180, hole=0.02, play=0.0005, time=1.2, speed=0.15):
    """Mean torque that turns a lever, which has the hole, against 50 N at 100 mm, and where its hole is, mm."""
    half, angles = (hole + 0.004) * np.tan(np.pi / walls), np.arange(walls) * 2.0 * np.pi / walls
    text = HEAD.format(mu=mu) + f'<geom type="cylinder" size="{hole - play} 0.01"/><body>'
    text += '<joint type="slide" axis="1 0 0" damping="100"/><joint type="slide" axis="0 1 0" damping="100"/>'
    text += '<joint type="hinge" axis="0 0 1"/><inertial pos="0 0 0" mass="0.2" diaginertia="1e-4 1e-4 2e-4"/>'
    for x, y, angle in zip((hole + 0.002) * np.cos(angles), (hole + 0.002) * np.sin(angles), angles, strict=True):
        text += f'<geom type="box" size="0.002 {half} 0.004" pos="{x} {y} 0" euler="0 0 {angle}" mass="1e-4"/>'
    model = mujoco.MjModel.from_xml_string(text + "</body></worldbody></mujoco>")
    data, found = mujoco.MjData(model), []
    steps, begin = round(time / model.opt.timestep), -side * speed * time * 0.75
    data.qpos[:] = [0.0, -play, begin]
    for k in range(steps):
        behind = begin + side * speed * k * model.opt.timestep - data.qpos[2]
        torque = 100.0 * behind + 2.0 * (side * speed - data.qvel[2])
        lever = 50.0 * 0.1 * np.cos(data.qpos[2])
        data.qfrc_applied[:] = [0.0, -50.0, torque - lever]
        mujoco.mj_step(model, data)
        found.append([torque - lever, data.qpos[0]])
    return 1e3 * np.mean(found[steps // 2 :], axis=0)


@pytest.mark.parametrize("side", [1, -1])
def test_lever_on_a_pin(side):
    """Its friction circle, and how far friction rolls the hole round its pin."""
    result = jp.loaded(lever(0.5, 0.2, 0.0), approach={1: "forward", -1: "backward"}[side])
    friction, shift = turned(0.2, side)
    assert_allclose(friction, result.drive_torque[0, 0] - 5000.0, rtol=0.05)
    assert_allclose(shift, result.error.sel(component="x")[0], rtol=0.08)
