"""The documentation: pages whose code is run, a gallery of the examples, and the API reference."""
