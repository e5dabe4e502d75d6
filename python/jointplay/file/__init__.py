"""The mechanism file: its text, its tables beside it, its schema, standards, and the files that results carry."""
