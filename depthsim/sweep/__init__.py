"""Sweeps: thousands of runs from one file, made on many cores or machines, and finished after any fault.

SWEEP.yaml (``spec.py``) -> plan (``resolve.py``, ``plan.py``, draws by ``draw.py``) -> jobs (``drive.py``) -> workers
of this machine (``pool.py``) or of a cluster (``rayrun.py``), each making ordinary run folders (``work.py``) in a
target (``target.py``, ``remote.py``) -> manifest (``manifest.py``).
"""
