"""What the compiled core is asked, and what it answers: a mechanism file as numbers."""
