"""Loop closure: candidates, registration of two sub-maps, and the tests that accept or refuse a loop."""
