"""Paper 3: the pose error of a 3-UPU robot, in closed form and by the general engine, mapped and taken apart.

Paper 3 is "Prediction of the pose errors produced by joints clearance for a 3-UPU parallel robot" (2009). The modules,
in the order of their imports:

    closed_form  the robot leg by leg: statics, support functions, pose error (numpy only)
    robot        the same robot as a file of 13 bodies
    study        the questions answered by jointplay at single poses, and what they depend on
    maps         the error over the workspace, kept as tables beside the page
    figures      the figures of the documentation page
    page         the page itself
"""
