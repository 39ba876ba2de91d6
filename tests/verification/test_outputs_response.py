"""All outputs of one pass are those of the single functions, and a failed reading fails its sample alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.builders import order_spectrum, seeded_units
from tolalloc.reading.units import ARCMINUTE, ARCSECOND
from tolalloc.reducers.equivalent.hysteresis import TURN_ANGLES, hysteresis_loop
from tolalloc.reducers.equivalent.model import Status, count_statuses
from tolalloc.reducers.response.outputs import OutputsResponse, Reading, orders_reading, requirements_of

ORDERS = (1, 39, 40)


@pytest.fixture(scope="module")
def x(prepared):
    return seeded_units(prepared.errors, 24)


@pytest.fixture(scope="module")
def response(prepared):
    return OutputsResponse(
        kernel=prepared.model.kernel, readings=(*requirements_of(prepared.model.reducer), orders_reading(ORDERS))
    )


@pytest.mark.slow
def test_every_output_is_that_of_its_own_function(prepared, response, x):
    kernel, found = prepared.model.kernel, response(x)
    assert found.good.all()
    values = dict(zip(response.outputs, found.values.T, strict=True))
    np.testing.assert_array_equal(values["peak-to-peak transmission error [arcsec]"], kernel(x).values[:, 0])
    loop = hysteresis_loop(kernel.model, kernel.errors(x), TURN_ANGLES)
    np.testing.assert_array_equal(values["lost motion [arcmin]"], loop.lost_motion / ARCMINUTE)
    np.testing.assert_array_equal(values["torsional stiffness [N·m/arcmin]"], loop.torsional_stiffness * ARCMINUTE)
    curves = kernel.model.equilibria(kernel.errors(x), kernel.torque).transmission_error
    spectrum = order_spectrum(curves)
    for order in ORDERS:
        amplitude = np.hypot(values[f"order {order} cosine [arcsec]"], values[f"order {order} sine [arcsec]"])
        np.testing.assert_allclose(amplitude, spectrum.amplitude[:, order - 1] / ARCSECOND, rtol=1e-12)


def test_a_wave_of_the_outputs_is_the_wave_of_the_curve(prepared, response, x):
    values = dict(zip(response.outputs, response(x[:1]).values[0], strict=True))
    found = prepared.model.kernel.model.equilibria(prepared.model.kernel.errors(x[:1]), prepared.model.kernel.torque)
    curve, angle = found.transmission_error[0] / ARCSECOND, found.carrier_angle
    for order in ORDERS:
        cosine, sine = np.cos(order * angle), np.sin(order * angle)
        assert values[f"order {order} cosine [arcsec]"] == pytest.approx(2 * (curve * cosine).mean(), abs=1e-9)
        assert values[f"order {order} sine [arcsec]"] == pytest.approx(2 * (curve * sine).mean(), abs=1e-9)


def test_a_sample_keeps_its_bits_in_other_company(response, x):
    whole = response(x).values
    np.testing.assert_array_equal(response(x[5:9]).values, whole[5:9])


def test_a_failed_reading_fails_its_sample_alone(prepared, x):
    def broken(_, errors):
        status = np.zeros(errors.shape[0], np.uint8)
        status[3] = 2
        return np.ones((errors.shape[0], 1)), status

    seen = []
    response = OutputsResponse(
        kernel=replace(prepared.model.kernel, observe=seen.append),
        readings=(requirements_of(prepared.model.reducer)[0], Reading(outputs=("broken [-]",), read=broken)),
    )
    found = response(x)
    assert np.flatnonzero(~found.good).tolist() == [3]
    assert np.concatenate(seen).tolist() == found.status.tolist()


def test_a_failed_unit_has_a_status_that_reports_count(response, x):
    broken = x.copy()
    broken[2, 0] = np.nan
    found = response(broken)
    assert np.flatnonzero(~found.good).tolist() == [2]
    assert Status(int(found.status[2])) is Status.NOT_FINITE
    assert sum(count_statuses(found.status).values()) == found.status.size
