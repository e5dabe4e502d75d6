"""The rows of docs/verification.md: every bundled example against engines that share nothing with jointplay."""
