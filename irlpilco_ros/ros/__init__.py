"""The toolkit of the nodes: clients, health, messages, parameters, quality of service, runtime."""
