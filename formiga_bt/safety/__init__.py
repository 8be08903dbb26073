"""What no tree can switch off: the gate that every effect passes before it leaves."""
