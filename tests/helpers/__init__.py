"""What tests and measurements share: independent oracles, generators of mechanisms, processes, browsers, fuzzers."""
