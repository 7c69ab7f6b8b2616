"""The error types of the wire. Decoding raises nothing else, whatever bytes arrive."""


class ProtocolError(ValueError):
    """Data on the wire, or meant for it, violate the protocol."""


class UnknownOpcodeError(ProtocolError):
    """A frame has an opcode that is no message in its direction."""


class PayloadLengthError(ProtocolError):
    """A payload is shorter or longer than its message."""


class BlockAddressError(ProtocolError):
    """A block extends beyond the address space."""


class UnitsError(ProtocolError):
    """A value is outside its register's range or the joint's range."""


class MemoryMapError(ProtocolError):
    """A memory map is inconsistent or lacks what the protocol needs."""
