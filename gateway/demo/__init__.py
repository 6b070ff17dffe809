"""The demo: the gateway drives the emulated bench over a real socket."""
