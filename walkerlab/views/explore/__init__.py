"""The interactive page of `walkerlab explore`, for which a server on this machine computes walks."""
