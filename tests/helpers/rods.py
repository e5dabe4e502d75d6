"""A rod between two balls, as the text of its file."""

RSSR = """
format = 1
space  = "spatial"
units  = { length = "mm", angle = "deg", force = "N" }

[joints.crank]
type = "revolute"
on.ground = { at = [0, 0, 0], axis = [0, 0, 1], side = [1, 0, 0] }
on.crank  = { at = [0, 0, 0], axis = [0, 0, 1], side = [1, 0, 0] }

[joints.hook]
type = "spherical"
on   = { crank = [30, 0, 0], coupler = [0, 0, 0] }
clearance = { radial = 0.2 }

[joints.ball]
type = "spherical"
on   = { coupler = [176, 0, 0], rocker = [0, 0, 100] }
clearance = { radial = 0.1 }

[joints.rocker]
type = "revolute"
on.ground = { at = [130, 0, -60], axis = [1, 0, 0], side = [0, 0, 1] }
on.rocker = { at = [0, 0, 0], axis = [1, 0, 0], side = [0, 0, 1] }

[start]
rocker = { rotation = [20, 0, 0] }

[drives.theta]
joint = "crank"
from  = 0
to    = 330
count = 12

[output]
body = "rocker"
at   = "ball"

[[loads]]
force = [2, 5, -10]

[dimensions.coupler]
body = "coupler"
between = ["hook", "ball"]
tolerance = 0.05
"""
