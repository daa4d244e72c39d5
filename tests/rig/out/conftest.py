def pytest_configure(config):
    config.addinivalue_line(
        "markers",
        "devices: needs Debian's umockdev, python3-gi and liblo-tools (`make system-deps`)",
    )
