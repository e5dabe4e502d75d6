"""What every room uses: arguments by their annotations, files, units, confidence intervals, poses, heads of pages."""
