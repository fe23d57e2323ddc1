import numpy as np
import pytest

from radioslam.config import PRESETS, Config, load_config
from radioslam.errors import ConfigError


def load(*overrides, preset=None, file=None, environment=None):
    """Without the variables of the machine that the tests run on."""
    return load_config(preset, file, overrides, environment or {})


@pytest.fixture
def file(tmp_path):
    return tmp_path / "settings.toml"


def test_the_preset_paper_has_the_values_of_the_paper():
    paper = load(preset="paper")
    assert paper.fingerprints.rss_threshold_dbm == -70.0
    assert paper.fingerprints.representation == "dbm"
    assert paper.uncertainty.bin_width == 0.1
    assert paper.uncertainty.max_distance_m == 30.0
    assert paper.loops.similarity_threshold == 0.8
    assert paper.loops.heading_variance == 1000.0
    assert paper.merging.heading_variance == 1000.0
    assert paper.screening.rule == "window"


def test_the_preset_paper_adds_no_unknowns_and_no_robust_loss():
    paper = load(preset="paper")
    assert not paper.merging.walk_scales
    assert paper.optimizer.loop_loss == "none"
    assert len(paper.loops.gates_m) == 1


def test_the_default_preset_differs_where_real_crowds_asked_for_it():
    default, paper = load(), load(preset="paper")
    assert default.fingerprints.rss_threshold_dbm < paper.fingerprints.rss_threshold_dbm
    assert default.fingerprints.representation != "dbm"
    assert default.screening.rule != "window"
    assert default.optimizer.loop_loss != "none"


@pytest.mark.parametrize("preset", PRESETS)
def test_every_preset_is_valid(preset):
    load(preset=preset)


def test_an_unknown_preset_is_an_error_that_names_the_known_ones():
    with pytest.raises(ConfigError, match=r"unknown preset 'papre'; expected one of paper, default"):
        load(preset="papre")


def test_a_file_beats_the_preset_and_leaves_the_rest_of_its_group(file):
    file.write_text("[fingerprints]\nrss_threshold_dbm = -82\n")
    config = load(file=file)
    assert config.fingerprints.rss_threshold_dbm == -82.0
    assert config.fingerprints.representation == load().fingerprints.representation


def test_the_environment_beats_the_file(file):
    file.write_text("[fingerprints]\nrss_threshold_dbm = -82\nmax_age_s = 7\n")
    config = load(file=file, environment={"RADIOSLAM_SET_FINGERPRINTS__RSS_THRESHOLD_DBM": "-83"})
    assert config.fingerprints.rss_threshold_dbm == -83.0
    assert config.fingerprints.max_age_s == 7.0


def test_the_command_line_beats_the_environment(file):
    environment = {"RADIOSLAM_SET_FINGERPRINTS__RSS_THRESHOLD_DBM": "-83", "RADIOSLAM_SET_SCREENING__RULE": "mutual"}
    config = load("fingerprints.rss_threshold_dbm=-84", environment=environment)
    assert config.fingerprints.rss_threshold_dbm == -84.0
    assert config.screening.rule == "mutual"


def test_of_two_overrides_the_last_wins():
    assert load("loops.similarity_threshold=0.1", "loops.similarity_threshold=0.2").loops.similarity_threshold == 0.2


def test_other_variables_of_the_environment_do_not_matter():
    assert load(environment={"HOME": "/root", "RADIOSLAM_DATA": "/data"}) == load()


def test_the_environment_of_the_process_is_read_by_itself(monkeypatch):
    monkeypatch.setenv("RADIOSLAM_SET_SCREENING__RULE", "mutual")
    assert load_config().screening.rule == "mutual"


def test_a_file_may_name_its_preset(file):
    file.write_text('preset = "paper"\n[loops]\nsimilarity_threshold = 0.9\n')
    config = load(file=file)
    assert config.fingerprints == load(preset="paper").fingerprints
    assert config.loops.similarity_threshold == 0.9


def test_words_tuples_and_spaces_are_understood_on_the_command_line():
    config = load("screening.rule = mutual", "loops.gates_m = [30, 5]", "odometry.heading=rotation_vector")
    assert config.screening.rule == "mutual"
    assert config.loops.gates_m == (30.0, 5.0)
    assert config.odometry.heading == "rotation_vector"


@pytest.mark.parametrize(
    "key", ["loops.similarity", "loop.similarity_threshold", "similarity_threshold", "loops.gates_m.first", ""]
)
def test_unknown_keys_are_errors(key):
    with pytest.raises(ConfigError):
        load(f"{key}=0.5")


def test_the_error_of_an_unknown_key_names_it_and_says_where_the_known_ones_are():
    with pytest.raises(ConfigError, match=r"unknown key 'loops\.similarity'; `radioslam config`"):
        load("loops.similarity=0.5")


def test_unknown_keys_in_a_file_or_variable_are_errors_too(file):
    file.write_text("[loops]\nsimilarity = 0.5\n")
    with pytest.raises(ConfigError, match=r"'loops\.similarity'"):
        load(file=file)
    with pytest.raises(ConfigError, match=r"'loops\.similarity'"):
        load(environment={"RADIOSLAM_SET_LOOPS__SIMILARITY": "0.5"})


@pytest.mark.parametrize(
    "override",
    [
        "loops.similarity_threshold=1.01",
        "loops.similarity_threshold=-0.01",
        "loops.similarity_threshold=high",
        "loops.similarity_threshold=nan",
        "loops.gates_m=[]",
        "loops.gates_m=[10, -1]",
        "fingerprints.rss_threshold_dbm=0",
        "fingerprints.rss_threshold_dbm=-128",
        "fingerprints.representation=amplitude",
        "uncertainty.bin_width=0",
        "uncertainty.min_samples=0",
        "merging.starts=anywhere",
        "screening.min_index_gap=2.5",
        "optimizer.max_iterations=0",
        "optimizer.tolerance=0",
        "odometry.typical_step_m=5",
        "uncertainty.max_distance_m=inf",
        "odometry.step_band_hz=[3.0, 1.0]",
        "odometry.step_band_hz=[0.5, 30.0]",
        "odometry.step_band_hz=[0.0, 3.0]",
        "loops=3",
    ],
)
def test_values_out_of_range_are_errors_that_name_the_key(override):
    with pytest.raises(ConfigError, match=override.partition("=")[0].replace(".", r"\.")):
        load(override)


def test_an_override_without_a_value_is_an_error():
    with pytest.raises(ConfigError, match=r"expected group\.key=value, found 'loops\.similarity_threshold'"):
        load("loops.similarity_threshold")


@pytest.mark.parametrize("content", [b"[loops", b"\xff\xfe\x00", b"loops: {}\n", b"preset = 3\n", b"preset = []\n"])
def test_a_file_that_is_no_configuration_is_an_error(file, content):
    file.write_bytes(content)
    with pytest.raises(ConfigError):
        load(file=file)


def test_a_missing_file_is_an_error_that_names_it(file):
    with pytest.raises(ConfigError, match=r"settings\.toml: expected a TOML file"):
        load(file=file)


def test_every_error_is_one_line(file):
    file.write_text("[loops\nx = ")
    for arguments in ({"file": file}, {"preset": "x"}):
        with pytest.raises(ConfigError) as caught:
            load(**arguments)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("preset", PRESETS)
def test_written_as_toml_and_read_again_nothing_changes(file, preset):
    config = load("loops.gates_m=[12.5, 3]", "odometry.step_band_hz=[0.5, 3.25]", preset=preset)
    file.write_text(config.to_toml())
    assert load(file=file, preset="paper") == config
    assert load(file=file, preset="default") == config


def test_a_configuration_cannot_be_changed():
    with pytest.raises(ValueError, match="frozen"):
        load().loops.similarity_threshold = 0.5


def test_the_configuration_made_without_words_is_the_papers():
    assert Config() == load(preset="paper")


def test_orientations_are_not_gated_unless_asked():
    assert load(preset="paper").loops.max_orientation_rad >= np.pi


def test_the_preset_of_the_command_line_beats_that_of_the_file(file):
    file.write_text('preset = "paper"\n')
    assert load(preset="default", file=file) == load()
