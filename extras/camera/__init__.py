"""A camera beside the arm: its picture on the page, and recorded into traces in step with the samples."""

from daq.plugins import Plugin

PLUGIN = Plugin(
    settings={"camera": "extras.camera.settings:CameraSettings"},
    parts=("extras.camera.part:Cameras",),
    routes=("extras.camera.routes:router",),
    pages=("camera",),
)
