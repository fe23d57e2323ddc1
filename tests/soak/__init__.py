"""Long trials of the service, apart from the test suite: ``python -m tests.soak [kills|mangled|load|speed]``."""
