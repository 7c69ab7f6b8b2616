"""The protocol between the host and the MA2000's motor controller: memory map, units, frames, commands.

Pure: bytes in, bytes out. Nothing here opens a port, waits or keeps time. PROTOCOL.md describes the same for a bridge
in another language.
"""
