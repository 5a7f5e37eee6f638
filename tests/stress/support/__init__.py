"""Code shared by the stress tests; harness.py runs them."""
