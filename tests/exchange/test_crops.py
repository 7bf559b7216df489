"""Check that heel strikes of cropped recordings are within their stated errors, on a few cases of
scripts/crop_campaign.py.
"""

import importlib.util
from pathlib import Path

import numpy as np

PLACE = Path(__file__).resolve().parents[2] / "scripts" / "crop_campaign.py"


def campaign():
    spec = importlib.util.spec_from_file_location("crop_campaign", PLACE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_all_strikes_of_a_cropped_recording_are_found_near_the_true_times(tmp_path):
    crops = campaign()
    rng = np.random.default_rng(3)
    counts = [crops.count_strikes(crops.draw(rng), rng, tmp_path) for _ in range(25)]
    assert [(each.missed, each.invented, each.problem) for each in counts] == [(0, 0, "")] * 25
    assert max(error for each in counts for error in each.errors) < 5.0


def test_error_of_a_strike_just_after_the_start_is_below_five_standard_errors(tmp_path):
    """The few samples before the strike must not distort the fit of those after it."""
    crops = campaign()
    for crop in (crops.Crop(1.39467, 4.218, 240.0, 1.75e-3, -1.0), crops.Crop(0.69340, 3.98, 25.0, 1.75e-4, -1.0)):
        counts = [crops.count_strikes(crop, np.random.default_rng(seed), tmp_path) for seed in range(6)]
        assert max(each.errors[0] for each in counts) < 5.0


def test_strike_on_a_sample_of_a_slow_film_is_not_missed(tmp_path):
    """If the sample changed sides in each fit, the strike would never converge."""
    crops = campaign()
    crop = crops.Crop(0.62168034, 4.26921954, 25.0, 1.75e-4, -1.0)
    counts = [crops.count_strikes(crop, np.random.default_rng(seed), tmp_path) for seed in range(8)]
    assert [each.missed for each in counts] == [0] * 8
    assert max(error for each in counts for error in each.errors) < 5.0


def test_error_bar_of_a_strike_found_late_at_the_first_sample_covers_the_true_time(tmp_path):
    """The strike is 9 ms before the first sample. If it is found at that sample, its error bar must reach back that
    far.
    """
    crops = campaign()
    crop = crops.Crop(1.416340339244594, 4.3245826090380675, 30.0, 1.7453e-3, -1.0)
    # In these three films of 300 the first sample counts as a strike.
    errors = [crops.count_strikes(crop, np.random.default_rng(seed), tmp_path).errors for seed in (227, 235, 280)]
    assert [len(each) for each in errors] == [5, 5, 5]
    assert max(each[0] for each in errors) < 3.0


def test_no_heel_strike_is_missed_in_a_slow_film_without_noise(tmp_path):
    """With the strike elsewhere, the error of the polynomials looks like a sensor that slips."""
    crops = campaign()
    crop = crops.Crop(1.4243780296881074, 4.93539416202693, 25.0, 0.0, -1.0)
    count = crops.count_strikes(crop, np.random.default_rng(0), tmp_path)
    assert (count.missed, len(count.errors)) == (0, 4)
