"""A pipeline whose points are quick, lack an answer, fail, or kill their process."""
