"""The questions, one a file. `compute` gives the light form of a result, the public function its `xarray.Dataset`."""
