"""Quality assurance: broken inputs, faults and interrupts, tried by the thousand and counted. See docs/testing.md."""
