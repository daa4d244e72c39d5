"""No circle among the folders of any package, whatever the layers of the linter know."""

from rig.studies.start.house import circles, folder, imports


def test_circles_are_found():
    assert circles([("a", "b"), ("b", "c"), ("c", "d"), ("d", "a"), ("e", "a")]) == 1
    assert circles([("a", "b"), ("b", "c"), ("a", "c")]) == 0


def test_a_module_lies_in_its_folder():
    assert folder("rig.studies.start.house") == "rig.studies.start"
    assert folder("rig.studies.start") == "rig.studies.start"


def test_folders_import_in_one_direction():
    assert circles(imports()) == 0
