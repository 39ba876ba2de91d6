"""Words of the reports that not every reader knows, each said in one plain sentence."""

from __future__ import annotations

from collections.abc import Iterable

GLOSSARY = {
    "capability, Cp": "Zone over six standard deviations of what the process makes; 1 leaves 0.27 % outside.",
    "Cpk": "Distance of the mean from the nearer limit over three standard deviations.",
    "certificate": "Lower bound on the cost of drawings that keep the limits: of all drawings where every limited "
    "value is linear in the deviations, of drawings near by otherwise; errors of units counted, no solver trusted.",
    "confidence": "Share of repeated studies in which such a statement is true.",
    "first-order index": "Share of the variance that one error makes alone (Sobol's S1).",
    "fresh units": "Random units that no search has used, on which the drawing is judged.",
    "lift": "How much larger the deviations are among the units beyond a limit than among all units.",
    "lost motion": "How far the output turns while the torque goes from +3 % to −3 % of the rated torque.",
    "NSGA-II": "A genetic search for designs that are each the cheapest for some limit.",
    "order": "Number of waves per turn of the output.",
    "peak-to-peak": "Largest minus smallest transmission error over one turn of the output.",
    "preloaded": "Said of a reducer whose pins press harder without torque than the rated torque presses them: it "
    "turns, but warm, worn early and without lost motion.",
    "quantile": "Value that a stated share of the units keeps.",
    "kept value per zone": "Change of what is compared with the limit per micrometre of the zone.",
    "Sens": "Change of the output per micrometre of deviation: with its sign for a single dimension, root mean square "
    "for a position or a wave, whose direction is random.",
    "surrogate": "Fast stand-in for the model, used only with its error stated.",
    "total index": "Share of the variance in which an error has a part, alone or with others (Sobol's ST).",
    "transmission error": "Angle by which the output is ahead of or behind the ideal ratio.",
    "yield": "Share of the units that keep a limit.",
    "zone": "Full width of what the drawing allows: both sides of ±, a diameter of position, a reading of run-out.",
}
"""Word → what it means, for readers of drawings; `docs/reference/nomenclature.md` has the names in the code."""

_OTHER = {"capability, Cp": ("Cp ", "capability"), "Sens": ("Sens ",), "surrogate": ("surrogate", "stand-in")}
"""How a word is written in reports where that differs from its entry."""


def words_in(texts: Iterable[str]) -> list[tuple[str, str]]:
    """Return the words of the glossary that stand in some texts, in alphabetical order.

    >>> [word for word, _ in words_in(["The yield at 60″."])]
    ['yield']
    """
    text = " ".join(texts)
    lower = text.lower()
    return [
        (word, meaning)
        for word, meaning in GLOSSARY.items()
        if any(own in text if own[0].isupper() else own in lower for own in _OTHER.get(word, (word,)))
    ]
