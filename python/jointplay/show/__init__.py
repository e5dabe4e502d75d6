"""What is shown of mechanisms and results: notebooks, interactive drawings, reports, the studio."""
