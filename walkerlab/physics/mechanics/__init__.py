"""Planar trees of rigid bodies: their parts, equations of motion and impacts."""
