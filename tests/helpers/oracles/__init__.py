"""Independent solutions that the tests hold jointplay against. Nothing in here imports jointplay."""
