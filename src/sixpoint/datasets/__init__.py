"""Public recordings, fetched on request: where they are, how they arrive whole, what their hashes were."""
