"""Walks asked for one setting at a time over a loopback connection: `walkerlab explore`."""
