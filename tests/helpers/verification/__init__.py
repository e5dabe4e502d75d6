"""The rows of docs/verification.json: every bundled example against engines that share nothing with jointplay."""
