"""What methods are measured by: walks, references, ladders of tolerances, a user's own script."""
