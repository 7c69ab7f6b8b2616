"""Reads JSON or protobuf messages of an MCAP file as a table: one row per message, one column per number."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.extras import require_extra
from daq.traces.mapping.expression import Columns
from extras.formats.bags.bag_storage import LARGEST_MESSAGE, Contents
from extras.formats.tables.flat import columns_of


def message_columns(origin: str, found: Contents, topic: str) -> Columns:
    """Returns the columns of a topic's messages, and `log_time`, in s since 1970. Raises TraceError,
    MissingExtraError."""
    messages = found.messages[topic]
    decode: Callable[[bytes], Any] = json.loads
    if found.encoding(topic) == "protobuf":
        decode = _protobuf(origin, *found.schemas[topic])
    rows = []
    for number, (_, raw) in enumerate(messages, start=1):
        try:
            rows.append(decode(raw[:LARGEST_MESSAGE]))
        except Exception as error:  # a damaged message makes a decoder raise any exception
            raise TraceError(f"{origin}: message {number}: {' '.join(str(error).split())[:200]}") from error
    return {"log_time": np.array([received for received, _ in messages]) / 1e9} | columns_of(rows)


def _protobuf(origin: str, name: str, schema: bytes) -> Callable[[bytes], Any]:
    """Returns a decoder by the descriptors in the file. Raises TraceError, MissingExtraError."""
    require_extra("ros", f"{origin}: messages of protobuf", "google")
    from google.protobuf import descriptor_pb2, descriptor_pool, json_format, message_factory

    try:
        files = descriptor_pb2.FileDescriptorSet.FromString(schema)
        pool = descriptor_pool.DescriptorPool()
        for file in files.file:
            pool.Add(file)
        kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(name))
    except Exception as error:  # a damaged schema makes protobuf raise any exception
        raise TraceError(f"{origin}: its schema cannot be read: {' '.join(str(error).split())[:200]}") from error

    def decode(raw: bytes) -> Any:
        return json_format.MessageToDict(
            kind.FromString(raw), preserving_proto_field_name=True, always_print_fields_with_no_presence=True
        )

    return decode
