"""The archive: long-term storage of traces by S3, in addition to the folder of traces."""

from daq.plugins import Plugin

PLUGIN = Plugin(
    settings={"archive": "extras.lab.archive.settings:ArchiveSettings"},
    migrations={"archived": "extras.lab.archive.versions"},
    checks=("extras.lab.archive.bucket:check",),
    parts=("extras.lab.archive.part:Archives",),
    routes=("extras.lab.archive.routes:router",),
)
