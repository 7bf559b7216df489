"""The rigid compass walker: Appendix A of the paper, the heel strike, and their derivatives."""
