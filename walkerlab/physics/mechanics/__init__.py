"""Planar trees of rigid bodies: described by their parts, turned into equations of motion."""
