"""Names of the batch's files: safe, distinct, and of the things alone, not of their order."""

from beamspread.core.disk import file_stems, stem


def test_letters_that_every_file_system_takes():
    assert stem(["../a/b", "c:d"]) == "a_b_c_d"
    assert stem(["..", "Größe"]) == "unnamed_Größe"
    assert stem(["Floor.001", "White-Marble"]) == "Floor.001_White-Marble"


def test_names_stay_plain_where_nothing_else_has_them():
    things = [("Floor", "Marble"), ("A b", "M"), ("Wall", "Marble")]
    assert [*file_stems(things).values()] == ["Floor_Marble", "A_b_M", "Wall_Marble"]


def test_equal_names_are_told_apart_in_any_order():
    things = [("A b", "M"), ("A/b", "M"), ("A_b", "M"), ("a_b", "m"), ("A", "b_M"), ("A", "b", "M"), ("other", "M")]
    names = file_stems(things)
    assert file_stems(things[::-1]) == names
    assert len({name.lower() for name in names.values()}) == len(things)
    # Names that need no change are kept; pairs of names have precedence over those with a layer.
    assert names["A", "b_M"] == "A_b_M"
    assert names["other", "M"] == "other_M"
    assert all(name.lower().startswith("a_b_m_") for names_, name in names.items() if name not in ("A_b_M", "other_M"))
