"""The error types of the wire. Decoding raises nothing else, whatever bytes arrive."""


class ProtocolError(ValueError):
    """Something on the wire, or meant for it, breaks the protocol."""


class UnknownOpcodeError(ProtocolError):
    """A frame whose opcode stands for no message of its direction."""


class PayloadLengthError(ProtocolError):
    """A payload that is shorter or longer than its message."""


class BlockAddressError(ProtocolError):
    """A block that reaches beyond the address space."""


class UnitsError(ProtocolError):
    """A value outside its register's range or the joint's range."""


class MemoryMapError(ProtocolError):
    """A memory map that contradicts itself or lacks what the protocol needs."""
