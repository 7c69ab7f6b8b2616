"""Where the lines are drawn. Every number was chosen on tuning arms, none of which is among those that report rates."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Thresholds:
    """What it takes to say something.

    Args:
        significant: evidence from which an effect counts as found.
        echo: share of the evidence already collected that a further effect must bring besides: where the law of an
            effect that has been added is not exactly the arm's, what is left of it is no effect of its own.
            distant_echo: the same of what was collected on other joints.
        kin: share of both that suffices for an effect that another joint has been found to have.
        margin: evidence over the next answer from which one name is given, instead of a group.
        unexplained: variance of a joint's error above its floor, in floors, above which something is missing that none
            of the known effects is. unnamed: the same on the traces fitted to, while no effect has been added; then
            also where the record is followed as in the fits. place: chance that one place of the map of a sound arm
            tells the same then.
        least_share: share of a joint's excess that effects must explain, or they only resemble what is missing.
        worse: rise of the held-out sum of squares, in its own standard deviations, at which a step is rejected, unless
            it is less than what is significant, or than the share `lost` of what as many samples have brought on the
            fitted traces: the tolerance parameters, none of them known for sure, have moved too. It is also rejected
            where a rise by more than its deviation takes the evidence below what is significant. grown: growth of what
            is beyond the noise floor of the held-out traces, on the effect's own joints, at which it is rejected as
            well; stuck joints let go by chance, so not at once.
        close: evidence within which rivals are fitted to their ends before they are compared.
        interesting: gain of a probe below which no candidate is worth a fit.
    """

    significant: float = 10.0
    echo: float = 0.03
    distant_echo: float = 0.005
    kin: float = 0.5
    margin: float = 4.0
    unexplained: float = 0.3
    unnamed: float = 0.12
    place: float = 0.001
    least_share: float = 0.8
    worse: float = 2.0
    lost: float = 0.5
    grown: float = 0.1
    close: float = 40.0
    interesting: float = 12.0

    def needed(self, here: float = 0.0, elsewhere: float = 0.0, *, kin: bool = False) -> float:
        """Evidence from which a further effect counts as found; so much was collected on its joints, and on others.

        Args:
            kin: whether the same effect has been found before.
        """
        line = self.significant + self.echo * here + self.distant_echo * elsewhere
        return line * self.kin if kin else line


THRESHOLDS = Thresholds()
