"""What the page of a test asks for, and what it is given: images, fields, readings, files."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from typing import Any

import numpy as np
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from rig.view import correlation, download, reading
from rig.view.asked import AskedGauges, AskedLine, AskedSettings
from rig.view.description import describe, drawn_as, limits_as_json
from rig.view.download import File
from rig.view.images import packed
from rig.view.preview import preview, recommended
from rig.view.viewed import ViewedTest
from rig.web.guard import CONTROLS

Answer = Callable[[ViewedTest, Request, bytes], Response]
"""Takes the test, the request and its body; raises ValueError or OSError in one sentence."""


def _state(test: ViewedTest, request: Request, body: bytes) -> Response:
    described = describe(test) | {"controls": bool(request.scope.get(CONTROLS))}
    return JSONResponse(described)


def _image(test: ViewedTest, request: Request, body: bytes) -> Response:
    """Give the image of a frame; that of the reference of the result where none is named."""
    name = request.query_params.get("name")
    if name is None:
        with test.result() as result:
            image = result.image.astype(np.float32)
            small = image if image.max() > 255 or image.min() < 0 else image.astype(np.uint8)
    else:
        small = test.image(name)
    height, width = small.shape
    return Response(packed(small), media_type="image/jpeg", headers={"x-size": f"{width},{height}"})


def _field(test: ViewedTest, request: Request, body: bytes) -> Response:
    """Give a field of a frame, (R·C,) float32, little-endian."""
    with test.result() as result:
        number = reading.frame_of(result, _whole(request, "frame"))
        values = result.field(request.query_params.get("name", ""), number)
    return _floats(values)


def _limits(test: ViewedTest, request: Request, body: bytes) -> Response:
    with test.result() as result:
        return JSONResponse(limits_as_json(result, request.query_params.get("name", "")))


def _preview(test: ViewedTest, request: Request, body: bytes) -> Response:
    found = preview(test, AskedSettings.model_validate_json(body))
    middle, high = found.levels
    return JSONResponse({
        "x": found.grid.xs.tolist(),
        "y": found.grid.ys.tolist(),
        "step": found.grid.step,
        "points": len(found.status),
        "measured": found.measured,
        "sigma": b64encode(found.sigma.astype("<f4").tobytes()).decode(),
        "status": b64encode(found.status.astype("i1").tobytes()).decode(),
        "median": reading.listed([middle])[0],
        "high": reading.listed([high])[0],
        "strain": reading.listed([found.strain_sigma])[0],
        "gauge": found.gauge_length,
        "reason": f"noise {found.noise.level:.3g} grey levels, {found.noise.source}; "
        + found.prefilter,
        "field": drawn_as("sigma_u") | {"title": "σ to expect of u and v"},
    })  # fmt: skip


def _recommend(test: ViewedTest, request: Request, body: bytes) -> Response:
    advice = recommended(test, request.query_params.get("reference", ""))
    return JSONResponse({
        "subset": advice.subset, "step": advice.step, "sigma": advice.sigma,
        "speckle": advice.speckle,
    })  # fmt: skip


def _line(test: ViewedTest, request: Request, body: bytes) -> Response:
    asked = AskedLine.model_validate_json(body)
    with test.result() as result:
        return JSONResponse(reading.line_as_json(result, reading.read_line(result, asked)))


def _readings(test: ViewedTest, request: Request, body: bytes) -> Response:
    asked = AskedGauges.model_validate_json(body)
    with test.result() as result:
        return JSONResponse(reading.gauges_as_json(reading.read_gauges(result, asked)))


def _regions(test: ViewedTest, request: Request, body: bytes) -> Response:
    text = correlation.saved_regions(AskedSettings.model_validate_json(body))
    return _sent(File(correlation.REGIONS, "application/toml", text.encode()))


def _correlate(test: ViewedTest, request: Request, body: bytes) -> Response:
    correlation.start(test, AskedSettings.model_validate_json(body))
    return JSONResponse(test.job.state.as_json())


def _job(test: ViewedTest, request: Request, body: bytes) -> Response:
    return JSONResponse(test.job.state.as_json())


def _stop(test: ViewedTest, request: Request, body: bytes) -> Response:
    test.job.stop()
    return JSONResponse(test.job.state.as_json())


def _frame_file(test: ViewedTest, request: Request, body: bytes) -> Response:
    with test.result() as result:
        return _sent(download.frame_table(result, _whole(request, "frame")))


def _field_file(test: ViewedTest, request: Request, body: bytes) -> Response:
    given = request.query_params
    limits = None
    if "low" in given and "high" in given:
        limits = _finite(given["low"]), _finite(given["high"])
        if not limits[0] < limits[1]:
            raise ValueError(f"limits must grow, got {limits[0]:g} to {limits[1]:g}; correct them")
    with test.result() as result:
        number = _whole(request, "frame")
        return _sent(download.field_plot(result, given.get("name", ""), number, limits))


def _line_file(test: ViewedTest, request: Request, body: bytes) -> Response:
    asked = AskedLine.model_validate_json(request.query_params.get("asked", ""))
    with test.result() as result:
        return _sent(download.line_files(result, asked, _kind(request)))


def _readings_file(test: ViewedTest, request: Request, body: bytes) -> Response:
    asked = AskedGauges.model_validate_json(request.query_params.get("asked", ""))
    with test.result() as result:
        kind = _kind(request)
        return _sent(download.gauge_files(result, asked, kind, test.interval))


def _test_file(test: ViewedTest, request: Request, body: bytes) -> Response:
    given = request.query_params
    with test.result() as result:
        return _sent(download.whole_test(result, given.get("way", ""), given.get("field", "exx")))


GETS: dict[str, Answer] = {
    "/state": _state,
    "/job": _job,
    "/image": _image,
    "/field": _field,
    "/limits": _limits,
    "/recommend": _recommend,
    "/files/frame.csv": _frame_file,
    "/files/field.png": _field_file,
    "/files/line.{kind}": _line_file,
    "/files/readings.{kind}": _readings_file,
    "/files/test.zip": _test_file,
}
POSTS: dict[str, Answer] = {
    "/preview": _preview,
    "/line": _line,
    "/readings": _readings,
    "/regions": _regions,
    "/correlate": _correlate,
    "/stop": _stop,
}


def _floats(values: Any) -> Response:
    data = np.asarray(values, dtype="<f4").tobytes()
    return Response(data, media_type="application/octet-stream")


def _sent(file: File) -> Response:
    disposition = {"content-disposition": f'attachment; filename="{file.name}"'}
    return Response(file.content, media_type=file.kind, headers=disposition)


def _kind(request: Request) -> str:
    kind = str(request.path_params["kind"])
    if kind not in ("csv", "png"):
        raise ValueError(f"there is no file of the kind '{kind}'; ask for csv or png")
    return kind


def _whole(request: Request, name: str) -> int:
    text = request.query_params.get(name, "")
    if not text.isdecimal():
        raise ValueError(f"{name} must be a whole number, got '{text}'; correct the address")
    return int(text)


def _finite(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise ValueError(f"a limit must be a number, got '{text}'; correct the address")
    return value
