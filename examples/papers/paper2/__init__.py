"""Paper 2, as far as it can be checked: what it prints, the formulas behind it, and the answers of jointplay beside it.

Paper 2 is Q. Zhao et al., "Assembly precision prediction for planar closed-loop mechanism in view of joint clearance
and redundant constraint", J. Mech. Sci. Technol. 32 (7) (2018) 3395-3405. The modules, in the order of their imports:

    published   what is printed, and its formulas (numpy only)
    study       the same questions answered by jointplay
    figures     the figure of the documentation page
    page        the page itself
"""
