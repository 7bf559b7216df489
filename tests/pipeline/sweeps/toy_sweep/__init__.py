"""A pipeline with points that are quick, lack an answer, fail, or kill their process."""
