"""Work beside the engine: what is run offline, on many processors or machines."""
