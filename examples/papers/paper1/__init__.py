"""Paper 1, table by table: what it prints, the rule behind it, and the exact figures of jointplay beside it.

Paper 1 is A. Jaiswal, D. A. Dsouza, H. P. Jawale, A. Jha, A. Kumar and M. Singh, "Error estimation and compensation in
4R and P3R closed-chain mechanisms due to joint clearance: a comparative study". The modules, in the order of their
imports:

    published   the tables as printed and the rule that produced them (numpy only)
    rings       where a pin can be at all: two rings, checked without jointplay
    exact       the same questions answered by jointplay
    tables      the tables of the documentation page
    figures     its figures
    page        the page itself
"""
