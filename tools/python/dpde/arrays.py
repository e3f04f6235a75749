# SPDX-License-Identifier: Apache-2.0
"""Values that a person gives, as arrays that the library reads.

An array of float64 in C order is read where it lies, whether NumPy's or, by DLPack, another library's. Copies are made
of lists and numbers, and of views that do not lie in one piece. Other types of numbers are refused: a silent conversion
would hide that half of the digits are gone.
"""
import numpy as np

_device_names = {1: "the processor", 2: "a CUDA device", 10: "a ROCm device"}


def _from_library(name, value):
    """An array of another library, without a copy."""
    device = value.__dlpack_device__()
    if int(device[0]) != 1:
        where = _device_names.get(int(device[0]), f"device {int(device[0])}")
        raise TypeError(f"{name}: the array is on {where}, and scenes run on the processor; copy it there first")
    try:
        return np.from_dlpack(value)
    except Exception as reason:
        raise TypeError(f"{name}: NumPy cannot read this {type(value).__name__}: {reason}") from reason


def as_array(name, value):
    """`value` as float64 in C order."""
    if isinstance(value, np.ma.MaskedArray):
        raise TypeError(f"{name}: an array without a mask is wanted; write a.filled(0.0)")
    if not isinstance(value, np.ndarray):
        if hasattr(value, "__dlpack__") and hasattr(value, "__dlpack_device__") and not isinstance(value, np.generic):
            value = _from_library(name, value)
        else:
            try:
                value = np.asarray(value)
                if value.dtype.kind in "iub":
                    value = value.astype(np.float64)
            except ValueError as reason:
                raise TypeError(f"{name}: this is no array: {reason}") from reason
    if value.dtype != np.float64 or not value.dtype.isnative:
        raise TypeError(f"{name}: an array of float64 is wanted, not of {value.dtype}; write a.astype(numpy.float64)")
    return value if value.flags.c_contiguous else np.ascontiguousarray(value)


def shaped(name, value, shape):
    """The same, of that shape."""
    value = as_array(name, value)
    if value.shape != shape:
        raise ValueError(f"{name}: an array of shape {shape} is wanted, not of {value.shape}; x is the last axis")
    return value
