"""The figure: friction over the slip velocity of a walk."""

from walkerlab.views.figures.canvas import blank
from walkerlab.views.figures.illustration import Illustration, Need

WALK = Need("contact-sim", "trajectory", ("slip_velocity_m_s", "friction_force_N"), "needs outputs: [forces]")


def draw(results):
    walk, figure = results["contact-sim"].groups["trajectory"], blank(3.0)
    figure.subplots().plot(walk["slip_velocity_m_s"], walk["friction_force_N"], ".")
    return figure, (abs(walk["friction_force_N"]).max(),)


TEXTS = {
    "title": "Friction over slip",
    "caption": "Friction force (N) over slip (m/s); at most {:.0f} N.",
    "seen": "A dot for each sample: friction rises with the slip velocity and then stays constant.",
}
FIGURES = (Illustration("friction-over-slip", (WALK,), draw, texts=TEXTS),)
