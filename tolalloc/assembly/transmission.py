"""What the final angles of an assembly do to the transmission of its reducer, over the precision weight."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.answer.answer import TransmissionEffect
from tolalloc.assembly.control import regulator
from tolalloc.assembly.gains import assembled, tuned_gains
from tolalloc.assembly.orientations import OrientationResponse, transmission_curves
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.assembly.trajectory import foreseen, random_numbers
from tolalloc.capability.experiment import LARGEST_FAILED_SHARE
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import SolveError
from tolalloc.models import Observer
from tolalloc.rv.equivalent.line_load import contact_pattern
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.reducer.files import load_reducer


def transmission_effect(
    plan: AssemblyPlan,
    errors: Float[np.ndarray, "part 3"] | None,
    precisions: Float[np.ndarray, " precision"],
    draws: int,
    seeds: SeedTree,
    observe: Observer,
) -> TransmissionEffect:
    """Return what the final angles do to the transmission.

    Parameters
    ----------
    plan
        The assembly; it names a reducer.
    errors
        Measured errors of the parts; unless given, parts are drawn from the plan's tolerances [rad].
    precisions
        Q [-].
    draws
        Assemblies drawn if no errors are given [-].
    seeds
        Node of the seed tree.
    observe
        Told the statuses of each chunk.

    Raises
    ------
    InputError, UnknownNameError
        The reducer cannot be read, or does not have a column that the chain moves.
    SolveError
        The first assembly or too many others have no answer.
    """
    reducer = load_reducer(plan.reducer)
    model, torque = EquivalentModel(reducer), reducer.load.test_torque
    response = OrientationResponse(model=model, chain=plan.chain, torque=torque, observe=observe)
    final = final_angles(plan, errors, precisions, draws, seeds)
    perfect = response(np.zeros((1, final.shape[2])))
    found = response(final.reshape(-1, final.shape[2]))
    good = np.asarray(found.good.reshape(final.shape[:2]).all(axis=0))
    if not (perfect.good.all() and good.any() and (~good).mean() <= LARGEST_FAILED_SHARE):
        raise SolveError(
            f"{plan.name}: {int((~good).sum())} of {good.size} assemblies have no equilibrium at some angle."
        )
    shown = response.errors(np.concatenate([np.zeros((1, final.shape[2])), final[:, np.argmax(good)]]))
    rated = float(np.copysign(reducer.load.rated_torque, torque))
    discs = [contact_pattern(model, shown[1], rated, disc + 1) for disc in range(reducer.disc_count)]
    worst = max(discs, key=lambda pattern: float(pattern.line_load.max()))
    return TransmissionEffect(
        reducer=reducer,
        test_torque=torque,
        precisions=precisions,
        outputs=response.outputs,
        perfect=perfect.values[0],
        values=found.values.reshape(*final.shape[:2], -1),
        good=good,
        perfect_curves=transmission_curves(model, shown[:1], rated),
        curves=transmission_curves(model, shown[1:], rated),
        patterns=tuple(contact_pattern(model, each, rated, worst.disc, worst.carrier_angle) for each in shown[1:]),
    )


def final_angles(
    plan: AssemblyPlan,
    errors: Float[np.ndarray, "part 3"] | None,
    precisions: Float[np.ndarray, " precision"],
    draws: int,
    seeds: SeedTree,
) -> Float[np.ndarray, "precision sample state"]:
    """Return final angles of the measured parts, or of the same random assemblies at every precision [rad].

    Parameters
    ----------
    plan, errors, precisions, draws, seeds
        As in `transmission_effect`.
    """
    space = plan.space
    if errors is not None:
        own = errors.ravel()[np.newaxis]
        weights = (plan.final_weight(float(precision)) for precision in precisions)
        return np.array([foreseen(space, regulator(space, weight), own).adjusted[:, -1] for weight in weights])
    standard = seeds.generator().standard_normal((draws, random_numbers(space)))
    return np.array(
        [
            assembled(plan, tuned_gains(plan, float(precision), plan.tolerances), plan.tolerances, standard).adjusted[
                :, -1
            ]
            for precision in precisions
        ]
    )
