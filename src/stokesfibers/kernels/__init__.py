"""Compiled kernels: one module per chain of calls, on plain arrays.

A kernel gives the same bits in every process, so that a run that is resumed ends as one that is
not. Two rules see to it.

Parts of a kernel are inlined by force and not cached by themselves. Otherwise a kernel fresh from
the compiler calls the part's own code, one from the cache the copy within it, and they round
differently.

Powers and products of complex numbers are written out in real numbers. For ``x**2`` or ``z * w``
numba calls functions of its own, which it compiles once in a process, with the freedom to
reassociate and contract of whichever kernel asks first. The bits would depend on what was compiled
before.
"""
