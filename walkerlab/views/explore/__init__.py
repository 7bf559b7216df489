"""The interactive page of `walkerlab explore`: walks computed on request over a loopback connection."""
