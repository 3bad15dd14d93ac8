"""The documentation: pages whose code runs, a gallery of the examples, and the reference."""
