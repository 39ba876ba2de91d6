"""An output: the root mean square of the transmission error about its mean."""

from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.response.kernel import Answer, KernelResponse
from tolalloc.reducers.response.outputs import Errors, Reading


def rms(kernel: KernelResponse, errors: Errors) -> Answer:
    """Return it at the torque of the study over one output turn [arcsec]."""
    found = kernel.model.equilibria(errors, kernel.torque)
    return found.transmission_error.std(axis=1, keepdims=True) / ARCSECOND, found.status.max(axis=1)


RMS = Reading(outputs=("rms transmission error [arcsec]",), read=rms)
