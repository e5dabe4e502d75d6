"""An arm with a slider, of which a test says what scatters."""

#: clearance of its pivot, length and drive errors move the output one to one; the length alone scatters, normally
ARM = """
format = 1
space = "planar"
units = { length = "mm", angle = "deg" }
[joints.pivot]
type = "revolute"
on = { ground = [0, 0], arm = [0, 0] }
clearance = { radial = 0.0 }
[joints.guide]
type = "prismatic"
on = { arm = { at = [0, 0], axis = [1, 0] }, rod = [0, 0] }
[drives.angle]
joint = "pivot"
values = [0]
[drives.reach]
joint = "guide"
values = [100]
[output]
body = "rod"
at = [50, 0]
[dimensions.size]
body = "rod"
between = ["guide", "output"]
tolerance = { sigma = 0.01 }
"""
