from symfric.bench.identification_memory import ranked


def test_lugre_is_flagged_on_data_of_gms_and_ranked_below_it() -> None:
    found = ranked()
    assert [row.law for row in found.rows] == ["gms", "lugre"]
    assert found["lugre"].status == "DOUBTFUL"
    assert 3 * found["gms"].validation < found["lugre"].validation
