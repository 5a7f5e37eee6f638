"""What stress tests share: see harness.py for how they are run."""
